"""The search for causes: candidates, model comparison, refinement, and the mathematics that they share."""
