"""The report of a diagnosis, its JSON document, and the extended plant that it offers."""
