"""The paper's experiments: rigs (copies of its rig), calibration (ladder and fits), laws (who turns a wanted force into
volts), closed_loop and trials (run laws on rigs), exercises (Figs. 7, 8, 9), limit (what the regulator's physics allows)."""
