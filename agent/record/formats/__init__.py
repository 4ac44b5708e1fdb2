"""How rows become bytes of a file and come back: Arrow, Parquet, CSV."""
