"""What a technician, the night and CI run: cell, cycle, recording, estimate, report."""
