"""Devices that speak in bytes, not in lines: Modbus RTU by a profile's registers, and the binary formats of single makers."""
