"""Record, and say why the force is off."""
