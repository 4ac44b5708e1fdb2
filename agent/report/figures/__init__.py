"""Pictures by what they show, and the canvas they share."""
