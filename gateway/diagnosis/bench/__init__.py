"""Recordings beside the twin that replays them: what drives it, its parameters by name, the residuals of all recordings."""
