"""The record that stays: catalogue, seals, verdicts, retention, export and import."""
