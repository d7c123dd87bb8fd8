"""The live page of `monitor`: what is remembered (track), how it looks (page, table, parts, picture), the polling (poll)."""
