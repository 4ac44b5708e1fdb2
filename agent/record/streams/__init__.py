"""A recording while it grows, and what becomes of it."""
