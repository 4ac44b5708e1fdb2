"""Would it be caught: a known rise, put into a joint's own healthy recordings."""
