"""From one joint's history to what is said of it: compared curves, reasons, sentences."""
