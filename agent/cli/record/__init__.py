"""Commands about kept recordings: catalogue, verify, import, export."""
