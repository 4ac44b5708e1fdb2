"""Commands about the recordings of many robots."""
