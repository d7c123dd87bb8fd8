"""Modbus TCP as bytes in and bytes out: framing (MBAP), requests of both roles, answers; no socket, no clock.

The server in gateway.fieldbus uses it. Addresses and values belong to the bank in gateway.registers. Sources: MODBUS
Application Protocol Specification V1.1b3, and MODBUS Messaging on TCP/IP Implementation Guide V1.0b.
"""

from gateway.modbus.diagnostics import ServerId
from gateway.modbus.errors import ModbusError, RequestError, RequestFault
from gateway.modbus.mbap import Adu, FramingLost, MbapFramer
from gateway.modbus.peer import Peer
from gateway.modbus.server import DataBank, answer

__all__ = [
    "Adu",
    "DataBank",
    "FramingLost",
    "MbapFramer",
    "ModbusError",
    "Peer",
    "RequestError",
    "RequestFault",
    "ServerId",
    "answer",
]
