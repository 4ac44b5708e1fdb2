"""CELL.toml: one robot cell as it is described, frozen and validated."""
