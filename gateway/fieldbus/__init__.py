"""The faces that masters connect to: Modbus TCP, plain and by TLS, and Modbus RTU on serial ports.

This room moves bytes and keeps peers in bounds; what a request means is decided in gateway.modbus and
gateway.registers.
"""

from gateway.fieldbus.rtu_server import ModbusRtuServer, RtuSettings
from gateway.fieldbus.settings import ServerSettings
from gateway.fieldbus.tcp_server import BindError, ModbusTcpServer
from gateway.fieldbus.tls_server import ModbusTlsServer
from gateway.fieldbus.tls_settings import TlsSettings

__all__ = [
    "BindError",
    "ModbusRtuServer",
    "ModbusTcpServer",
    "ModbusTlsServer",
    "RtuSettings",
    "ServerSettings",
    "TlsSettings",
]
