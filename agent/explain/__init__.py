"""Where simulation and recordings differ: located, named, modelled and proven. No file, no plot."""
