"""What an extended plant is worth to the controller, on its twin and in virtual time."""
