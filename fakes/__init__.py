"""Devices that are not there: real bytes, own physics, injected time. No product code."""
