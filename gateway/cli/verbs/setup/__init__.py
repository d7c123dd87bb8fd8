"""Set up a cell."""
