"""A rig: the form of its file, the checks between its parts, and the frozen object that the service wires."""
