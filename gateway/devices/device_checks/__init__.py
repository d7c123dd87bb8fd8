"""What is asked of a device besides its work: what it is, and whether its own watchdog watches the host."""
