"""Commands about devices: simulated ones, register maps, EDS files, what a bus carries."""
