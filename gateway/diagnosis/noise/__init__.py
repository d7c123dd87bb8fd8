"""The noise of the readings: its spectrum, the whitening of residuals, and the floor that a recording proves by itself."""
