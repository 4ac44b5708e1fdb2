"""How the CSV files of drive studios are to be read, as data: one TOML file a studio."""
