"""The calibration staircase: its plan, and what a table or a recording says about each of its settled points."""
