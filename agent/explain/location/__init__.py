"""Where a mismatch lies: the deficiency map, regions, curves, and what is left over."""
