"""Modbus as bytes in and bytes out: framing of TCP (MBAP) and of RTU, requests of both roles, answers; no port, no clock.

The servers in gateway.fieldbus use it. Addresses and values belong to the bank in gateway.registers. Sources: MODBUS
Application Protocol Specification V1.1b3, MODBUS Messaging on TCP/IP Implementation Guide V1.0b, and MODBUS over Serial Line
Specification and Implementation Guide V1.02.
"""

from gateway.modbus.diagnostics import ServerId
from gateway.modbus.errors import ModbusError, RequestError, RequestFault
from gateway.modbus.mbap import Adu, FramingLost, MbapFramer
from gateway.modbus.peer import Peer, Role
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
    "Role",
    "ServerId",
    "answer",
]
