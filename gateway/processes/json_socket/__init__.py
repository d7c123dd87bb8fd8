"""A local socket that answers one JSON object per line."""
