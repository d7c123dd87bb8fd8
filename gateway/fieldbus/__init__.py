"""The faces that masters connect to. Modbus TCP now; RTU and TLS use the same connection rules.

This room moves bytes and keeps peers in bounds; what a request means is decided in gateway.modbus and
gateway.registers.
"""

from gateway.fieldbus.settings import ServerSettings
from gateway.fieldbus.tcp_server import BindError, ModbusTcpServer

__all__ = ["BindError", "ModbusTcpServer", "ServerSettings"]
