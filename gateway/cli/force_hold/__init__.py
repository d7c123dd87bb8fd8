"""Holding a force from the command line: what a master writes (`run`), the thread that writes it (`beat`), what people see."""
