"""Numbered, immutable documents of one rig in its state directory, and which of them is in use: calibrations and plants."""
