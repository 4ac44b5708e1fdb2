"""Which effects a mismatch consists of: search, chance, materiality, shares, aliases."""
