"""Friction over velocity and temperature: passes, the curve, its laws, the surface."""
