"""Files of other programs made recordings."""
