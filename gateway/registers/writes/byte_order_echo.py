"""byte_order_echo: the master writes 1234.5 once, and so proves that it and the gateway mean the same number.

Both word orders are accepted, because a CDAB client has a block of its own (300) and must be able to prove itself too.
The words read back as written: 0x449A first is ABCD, 0x5000 first is CDAB. Swapped bytes, integers and anything else
are refused (03).
"""

from typing import Final

from gateway.codes.refusals import RefusalReason
from gateway.registers.image import RegisterImage
from gateway.registers.map.register_map import Register
from gateway.registers.refusal import Refusal
from gateway.registers.values import WordOrder, pack_number, unpack_number
from gateway.registers.writes.command_block import check_zeros
from gateway.registers.writes.ownership import keep_latest

PROOF: Final = 1234.5
_ORDERS: Final = {pack_number("float32", order, PROOF): order for order in WordOrder}


class ByteOrderEcho:
    """Remembers which hosts have proven their word order, the latest 64 of them. ValueError for a register that is no float."""

    def __init__(self, register: Register, image: RegisterImage) -> None:
        if register.type != "float32":
            raise ValueError(f"byte_order_echo is {register.type}, float32 is needed")
        self._register = register
        self._image = image
        self._proven: dict[str, None] = {}  # in the order of their proofs

    def is_proven_by(self, host: str) -> bool:
        """Return whether this host has shown its word order."""
        return host in self._proven

    def write(self, address: int, data: bytes, host: str) -> WordOrder | None:
        """Take a write of whole values to the proof block. Return the word order that it proves, None for reserved
        words only."""
        at = self._register.address - address
        if not 0 <= at < len(data) // 2:
            check_zeros(address, data)
            return None
        echo = data[2 * at : 2 * at + 4]
        check_zeros(address, data[: 2 * at])
        check_zeros(address + at + 2, data[2 * at + 4 :])
        if (order := _ORDERS.get(echo)) is None:
            raise self._refusal(float(unpack_number("float32", WordOrder.ABCD, echo)))
        self._image.write(self._register.address, echo)
        keep_latest(self._proven, host, None)
        return order

    def _refusal(self, value: float) -> Refusal:
        is_number = value == value and abs(value) != float("inf")
        reason = RefusalReason.OUT_OF_RANGE if is_number else RefusalReason.NOT_FINITE
        text = f"byte_order_echo = {value:g}, allowed 1234.5 in either word order: swapped bytes, or an integer?"
        return Refusal(reason, self._register.address, text, value=value)
