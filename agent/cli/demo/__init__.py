"""`stribeck demo`: the whole story on a simulated joint."""
