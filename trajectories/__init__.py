"""What to drive: frozen, validated, serialisable motion on the motor side. NumPy only."""
