"""What the controller conducts by itself: calibration ladders and experiments."""
