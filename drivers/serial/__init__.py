"""Devices that speak lines of text on a serial port (pyserial)."""
