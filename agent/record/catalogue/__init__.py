"""Which recordings there are, in a database."""
