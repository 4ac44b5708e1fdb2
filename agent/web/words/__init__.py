"""What the page says, by what it says it of."""
