"""The numbered calibrations of a rig: stored, checked for the rig, taken into use, rolled back, and uploaded by a master."""
