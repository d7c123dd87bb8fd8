"""The report of a fit and its JSON document."""
