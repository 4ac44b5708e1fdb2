"""What is compared: recordings as filtered rows in strata, their scene, their noise floor."""
