"""The numbered plants of a rig: what a diagnosis has extended, where it comes from, and what of it control compensates."""
