"""What a model leaves: whether it depends on anything, what may be said of it, and what would show its nature."""
