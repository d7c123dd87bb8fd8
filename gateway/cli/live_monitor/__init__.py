"""The live page of `monitor`: the polling (poll), what is remembered (history), its looks (page, register_table, drawing)."""
