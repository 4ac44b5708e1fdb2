"""The process that reads a bus: the standard library alone, so that it starts at once and is small.

`drivers.can` starts it and takes what it has read; nothing here may import that, or python-can.
"""
