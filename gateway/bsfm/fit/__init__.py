"""Fitting models to a ladder: variable projection, the choice of the order, errors, and the response over time."""
