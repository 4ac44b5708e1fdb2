"""How to reach devices: the only home of bus libraries. Imports nothing of ours."""
