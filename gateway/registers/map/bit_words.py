"""The two words whose bits can be read, and of one written, one by one: as coils and discrete inputs."""

from collections.abc import Sequence
from typing import Final

from gateway.registers.map.addresses import no_such_address
from gateway.registers.map.register_map import Block, RegisterMap

_BITS: Final = 16


class BitWords:
    """Bit k of a word at address A is coil A + k: each word is a block of coils."""

    def __init__(self, register_map: RegisterMap) -> None:
        firsts = {name: register_map.find(name).address for name in ("control_word", "status_word")}
        self.control, self.status = (Block(name, first, first + _BITS - 1) for name, first in firsts.items())

    def find(self, address: int, count: int) -> Block:
        """Return the word that holds these coils. Refusal (02) where none holds them all."""
        words = (self.control, self.status)
        for word in words:
            if count > 0 and word.first <= address and address + count - 1 <= word.last:
                return word
        raise no_such_address(words, address, count)


def mask_of_bits(shift: int, values: Sequence[bool]) -> tuple[int, int]:
    """Return which bits of a word these values from bit `shift` on are, and what they make of them."""
    mask = ((1 << len(values)) - 1) << shift
    return mask, sum(bool(value) << k for k, value in enumerate(values)) << shift
