"""The chosen effects beside the twin, fitted: numbers, intervals, and which number is wrong."""
