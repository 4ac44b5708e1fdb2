"""CiA 404 measuring devices on CAN: a temperature beside the drive, on the drive's own bus."""
