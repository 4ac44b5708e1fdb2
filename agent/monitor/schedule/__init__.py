"""How often to test, and whether a cycle was run warm or cold."""
