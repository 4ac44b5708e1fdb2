"""What every command shares: talk, exit codes, interrupts, threads, pictures."""
