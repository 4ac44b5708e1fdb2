"""Commands that ask a simulation: explain and simulate."""
