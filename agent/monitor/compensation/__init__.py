"""What temperature, payload and load do to a feature, of a joint's own cycles and of its kind's."""
