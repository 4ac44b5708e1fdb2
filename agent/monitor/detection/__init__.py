"""Detectors and their tuning: from a series of features to NF, H0 and H1, by one interface."""
