"""Commands of the night: its plan, its cycles, its telling."""
