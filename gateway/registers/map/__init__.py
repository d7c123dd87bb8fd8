"""The Modbus map as data: read from its file, looked up by address, printed for people."""
