"""What tools/fit_demo is made of: runs on the twin, the comparison with the committed file, the picture."""
