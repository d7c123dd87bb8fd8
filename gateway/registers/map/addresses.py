"""What a wrong address probably was: a register's name taken for its address (W202), or counting from 1 (W203).

Only what the request itself shows is judged: a range that would fit exactly if it were moved by one word. That a master
writes force_setpoint one register too far cannot be seen.
"""

from collections.abc import Sequence
from typing import Final

from gateway.codes.refusals import OFF_BY_ONE, RefusalReason
from gateway.registers.map.register_map import Block, Register
from gateway.registers.refusal import Refusal

_BEFORE_THE_FIRST: Final = 0xFFFF
_NAMES: Final = ((40001, 49999, "holding register"), (30001, 39999, "input register"), (10001, 19999, "discrete input"))


def no_such_address(blocks: Sequence[Block], address: int, count: int) -> Refusal:
    """Return the refusal of a range that no block holds."""
    if shifted := _explain_shift(blocks, address, count):
        return Refusal(OFF_BY_ONE, address, shifted)
    ranges = ", ".join(f"{block.first}-{block.last}" for block in blocks)
    verb = "is" if count == 1 else "are"
    elsewhere = f"{_range(address, count)} {verb} not in one block; blocks are {ranges}"
    return Refusal(RefusalReason.ADDRESS, address, _explain_name_as_address(address) or elsewhere)


def read_only(register: Register) -> Refusal:
    """Return the refusal of a write to a register that can only be read."""
    text = f"{register.name}@{register.block} at {register.address} is read only"
    return Refusal(RefusalReason.READ_ONLY, register.address, text)


def _range(address: int, count: int) -> str:
    return f"address {address}" if count == 1 else f"addresses {address} .. {address + count - 1}"


def _explain_name_as_address(address: int) -> str:
    for first, last, what in _NAMES:
        if first <= address <= last:
            return f"{address} is the name of address {address - first}: a {what}'s name counts from {first}"
        if address == first - 1:
            return f"address {address}: {first} is the name of address 0, ask for register 1 (or address 0)"
    return ""


def _explain_shift(blocks: Sequence[Block], address: int, count: int) -> str:
    if address == _BEFORE_THE_FIRST:
        return f"address {address} is what register 0 becomes where a client counts from 1: the first register is 1 (address 0)"
    for block in blocks:
        inside = f"block {block.name} is {block.first} .. {block.last}"
        if block.first <= address <= block.last + 1 == address + count - 1:
            return f"{_range(address, count)} ends one past its block, {inside}: off by one? addresses count from 0"
        if address == block.first - 1 and address + count - 1 <= block.last:
            return f"{_range(address, count)} begins one before its block, {inside}: off by one? -r counts from 1 in mbpoll"
    return ""
