"""What devices are like, as data: TOML files and nothing else."""
