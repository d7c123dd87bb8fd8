"""Pictures of the report: all of them by name, how they look, and one file for each source of data."""
