"""The command line: one file per verb, nothing heavy imported at top level."""
