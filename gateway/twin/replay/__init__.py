"""The twin run over a recording, many plants at once, on the rows as they were sent."""
