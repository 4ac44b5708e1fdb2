"""When a feature changed, how, and what is ahead if nothing changes."""
