"""A write of the command block: as it came, as far as its host may ask for it, and as it is admitted."""

from collections.abc import Callable
from typing import Final, NamedTuple

from gateway.modbus import Peer
from gateway.registers.command import Command
from gateway.registers.map.register_map import Block
from gateway.registers.writes.command_block import Values

ALL_BITS: Final = 0xFFFF


class Write(NamedTuple):
    """A write of the command block. touched: bits of the control word that the master has named (coils name some)."""

    block: Block
    address: int
    data: bytes
    host: str
    peer: Peer
    touched: int = ALL_BITS


class AdmittedWrite(NamedTuple):
    """values: to store; kept: control word that reads back; command: what control gets, edge bits included; is_stop: the
    output goes off; is_taken_over: this host owns from now on, explicitly; held: bits of runs that this host keeps at 1;
    is_plain: no bit rises or falls; stands: it is of a program that stands still, and makes nobody the owner of what is
    out for a lost master."""

    values: Values
    kept: int
    command: Command
    is_stop: bool
    is_taken_over: bool
    held: int
    is_plain: bool = False
    stands: bool = False


OnWrite = Callable[[Peer, Values, AdmittedWrite, tuple[str | None, str | None]], None]
"""on_write(peer, values before, what was admitted, owner before and after) of each accepted write."""


class PermittedWrite(NamedTuple):
    """What a write asks for, as far as its host may ask for it. written: its control word; is_stop: the output goes off."""

    values: Values
    written: int
    is_stop: bool
