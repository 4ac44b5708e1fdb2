"""Example files that ship with the product. No code."""
