"""Least squares of a model on the bench: the base model, what is remembered at the first row, and their mathematics."""
