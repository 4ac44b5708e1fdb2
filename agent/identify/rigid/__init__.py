"""The rigid body of an axis: regression, instruments, recursion, and what it leaves."""
