"""What is watched while the output is enabled, apart from the force loop."""
