"""Commands that estimate from recordings: friction, twin, ripple, heat, flexible joint, gap."""
