"""What an explanation says: its result, places and words, without any of the arithmetic."""
