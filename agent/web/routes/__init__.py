"""What the page answers to, by story."""
