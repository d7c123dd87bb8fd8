"""From the recording of a ladder to a fit, a report and a numbered calibration that may be offered or not."""
