"""The formulas of the effects that a plant may have beyond its plain physics."""
