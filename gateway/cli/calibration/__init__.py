"""Following a calibration run in the terminal: where it is asked and followed, the progress line, and going on with it."""
