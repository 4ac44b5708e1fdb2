"""Commands that move a joint, or say how it would be moved: run, plan, contour, recover, stop."""
