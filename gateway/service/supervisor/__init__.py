"""The guardian and its children: start them, watch their heartbeat, end them, and keep the safe voltage on the wire."""
