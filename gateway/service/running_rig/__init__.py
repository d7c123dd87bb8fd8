"""One running rig: its two lines, the register bank's rules, recording, calibration runs, and the control loop between them."""
