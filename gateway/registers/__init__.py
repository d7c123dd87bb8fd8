"""The Modbus map and the register bank: names, addresses and limits; what may be written, and what the registers show.

Pure: bytes, peers and the time come in, a frozen `Command` goes out, refusals say why. The map itself is a YAML file in
profiles/registers.
"""

from gateway.registers.bank import RegisterBank
from gateway.registers.command import Command, Status
from gateway.registers.map.document import FORMATS, render_block, render_most_used, render_registers
from gateway.registers.map.map_reader import MapError
from gateway.registers.map.register_map import Block, Register, RegisterMap, UnknownRegister
from gateway.registers.refusal import Refusal
from gateway.registers.rig_rules import BankRules
from gateway.registers.values import WordOrder

__all__ = [
    "FORMATS",
    "BankRules",
    "Block",
    "Command",
    "MapError",
    "Refusal",
    "Register",
    "RegisterBank",
    "RegisterMap",
    "Status",
    "UnknownRegister",
    "WordOrder",
    "render_block",
    "render_most_used",
    "render_registers",
]
