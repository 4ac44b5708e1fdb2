"""CAN: one owner per bus, stamps, loss accounting. No drive profile knowledge."""
