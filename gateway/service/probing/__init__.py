"""Which device is behind a port? Listening, and questions that change nothing: at each speed, in each profile's words."""
