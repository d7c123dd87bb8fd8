"""Keep it running."""
