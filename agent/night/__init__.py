"""When to run, one attempt, and who is told. No bus is opened here, and nothing moves from here."""
