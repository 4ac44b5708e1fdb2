"""The composition root: what a cell describes becomes drivers' objects, and a cycle that runs."""
