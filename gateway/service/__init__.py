"""One rig in operation: its supervisor, control process, running rig, fits and the closed-loop study."""
