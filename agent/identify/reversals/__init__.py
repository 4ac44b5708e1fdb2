"""What the joint does where it turns round: presliding, clearance, wind-up. No file, no plot."""
