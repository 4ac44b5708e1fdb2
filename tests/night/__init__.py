"""The night: windows, one attempt, what was missed, who is told."""
