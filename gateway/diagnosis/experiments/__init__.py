"""What a recording can show, and what to record next."""
