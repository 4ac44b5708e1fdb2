"""Friction from ordinary work, where it excites enough; and why not where it does not."""
