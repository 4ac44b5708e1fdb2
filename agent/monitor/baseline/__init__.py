"""What healthy cycles teach: the baseline, how it grows, and who has none yet."""
