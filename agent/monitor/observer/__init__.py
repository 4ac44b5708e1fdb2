"""An observer on ordinary motion that asks for a dedicated cycle."""
