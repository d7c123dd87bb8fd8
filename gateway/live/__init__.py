"""What processes beside control read of a running gateway: the sample ring and the control socket."""
