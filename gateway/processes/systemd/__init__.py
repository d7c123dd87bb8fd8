"""What a service says to systemd: that it is ready and alive, and its events for the journal. Standard library only."""
