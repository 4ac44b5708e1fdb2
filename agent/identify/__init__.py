"""From signals to an honest estimate. Pure functions on arrays: no file, no bus, no plot."""
