"""The table: statement of the paper, its value, ours, and whether that is a reproduction; a file for each group of figures."""
