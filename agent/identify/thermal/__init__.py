"""How a gearbox cools and warms, and what friction makes of it."""
