"""A joint's cycles in order: what each was, what was done to the joint, what belongs together."""
