"""The Modbus faces of one running rig: TCP, TLS and serial ones, and those that are still to come."""
