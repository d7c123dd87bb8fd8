"""A gateway that systemd keeps: the unit, the udev rule, and what is asked of systemctl."""
