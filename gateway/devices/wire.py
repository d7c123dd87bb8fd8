"""A simulated wire: bytes need time, and a wrong speed makes garbage. Pure; gateway.ports.PacedPty runs it on a pty."""

from math import floor
from typing import Final

MOST_QUEUED_BYTES: Final = 4096  # what a driver would buffer; more is dropped, as a UART overrun does


class PacedWire:
    """One direction of a serial line: a byte is through when its last bit has passed.

    Times are monotonic seconds, given by the caller; they must not go back.
    """

    def __init__(self, baud: int, bits_per_character: int = 10) -> None:
        self.character_s = bits_per_character / baud
        self._queue = bytearray()
        self._first_through_s = 0.0  # when the first queued byte is through
        self._free_s = 0.0  # when the last byte was through
        self.dropped_bytes = 0

    def send(self, data: bytes, now_s: float) -> None:
        """Hand bytes to the sender at now_s; they follow what is still on the wire."""
        accepted = data[: self.room]
        self.dropped_bytes += len(data) - len(accepted)
        if not self._queue:
            self._first_through_s = max(now_s, self._free_s) + self.character_s
        self._queue += accepted

    @property
    def room(self) -> int:
        """Number of bytes that are taken now."""
        return MOST_QUEUED_BYTES - len(self._queue)

    @property
    def last_through_s(self) -> float | None:
        """Time at which the last queued byte will be through, None when the wire is idle."""
        return self._through_s(len(self._queue)) if self._queue else None

    def bytes_through(self, now_s: float) -> bytes:
        """Take the bytes whose last bit has passed by now_s."""
        if not self._queue or now_s < self._first_through_s:
            return b""
        count = min(len(self._queue), 1 + floor((now_s - self._first_through_s) / self.character_s))
        if count < len(self._queue) and now_s >= self._through_s(count + 1):
            count += 1  # the division rounded down what the clock has reached
        data = bytes(self._queue[:count])
        self._free_s, self._first_through_s = self._through_s(count), self._through_s(count + 1)
        del self._queue[:count]
        return data

    def _through_s(self, count: int) -> float:
        return self._first_through_s + (count - 1) * self.character_s


def resample_at_baud(data: bytes, sent_baud: int, heard_baud: int) -> bytes:
    """Return what a UART at heard_baud makes of characters (8N1) sent at sent_baud.

    The levels of the line are sampled as a receiver does: a start edge, then the middle of each bit. Characters without
    a stop bit (framing errors) are delivered as they were sampled, as Linux does with IGNPAR unset and INPCK off. No more
    than a driver would buffer: at 50 baud one character is heard as hundreds. An end that is set to 0 baud (B0) has hung up.
    """
    if sent_baud == heard_baud:
        return data
    if not sent_baud or not heard_baud:
        return b""
    levels = _levels(data)
    step = sent_baud / heard_baud  # bits of the sender in one bit of the receiver
    received = bytearray()
    position = 0.0
    while len(received) < MOST_QUEUED_BYTES and (start := levels.find(0, floor(position))) >= 0:
        position = max(position, float(start))
        samples = [_level(levels, position + (bit + 0.5) * step) for bit in range(1, 9)]
        received.append(sum(bit << place for place, bit in enumerate(samples)))
        position += 9.5 * step
    return bytes(received)


def _levels(data: bytes) -> bytes:
    """The line level during each bit: start 0, eight data bits from the lowest, stop 1."""
    return bytes(level for byte in data for level in (0, *((byte >> place) & 1 for place in range(8)), 1))


def _level(levels: bytes, position: float) -> int:
    index = int(position)
    return levels[index] if index < len(levels) else 1  # an idle line is high
