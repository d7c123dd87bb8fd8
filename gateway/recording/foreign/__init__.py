"""What other programs write: their encodings, workbooks, stamps of time and headers, turned into what our readers take."""
