"""Pictures and the offline report. Called from the top only."""
