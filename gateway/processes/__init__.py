"""What each of our processes has: priority, clock tick, messages, events, local socket, and files that are whole or absent."""
