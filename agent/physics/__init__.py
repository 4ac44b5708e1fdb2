"""The laws of a joint, each in one home. No file, no bus, no plot."""
