"""Friction change over months: features, compensation, detection, reasons. No file, bus or plot."""
