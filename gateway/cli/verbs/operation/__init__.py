"""Run a gateway and command a force."""
