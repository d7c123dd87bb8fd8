"""How a plant follows a voltage: dead time and lags, identified from the steps of a calibration run."""
