"""Cards: one thing at a time for a terminal, an effect of the catalogue or a register of the map."""
