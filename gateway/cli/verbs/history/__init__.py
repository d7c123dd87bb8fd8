"""See what happened."""
