"""The candidates: every form of every effect, and the hidden states that some of them need."""
