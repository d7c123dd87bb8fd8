"""Modbus as bytes in and bytes out: framing (MBAP, RTU), requests and answers, both roles; no socket, no clock.

The server faces in fieldbus and the codecs of RTU devices share it. Addresses and values belong to the bank in
gateway.registers.
"""

from gateway.modbus.diagnostics import ServerId
from gateway.modbus.errors import ModbusError, RequestError, RequestFault
from gateway.modbus.host import AnswerMismatch, answer_bits, answer_data
from gateway.modbus.mbap import Adu, FramingLost, MbapFramer
from gateway.modbus.peer import Peer
from gateway.modbus.server import DataBank, answer

__all__ = [
    "Adu",
    "AnswerMismatch",
    "DataBank",
    "FramingLost",
    "MbapFramer",
    "ModbusError",
    "Peer",
    "RequestError",
    "RequestFault",
    "ServerId",
    "answer",
    "answer_bits",
    "answer_data",
]
