"""Torque that repeats with the motor angle: which orders, how large, and of what origin."""
