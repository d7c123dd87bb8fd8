"""The effects that the diagnosis knows, in the order of the signal."""
