"""MBAP framing of Modbus TCP: a byte stream in, whole requests out, whatever the segments were.

Lost framing cannot be found again (there is no mark in the stream), so a wrong protocol id or length ends the
connection; the frames before it stay valid and come out first.
"""

from struct import Struct
from typing import Final, NamedTuple

from gateway.modbus.crc import crc16

HEADER: Final = Struct(">HHHB")  # transaction, protocol, length of what follows it, unit
_SHORTEST_LENGTH: Final = 2  # unit and function
_LONGEST_LENGTH: Final = 254  # unit and a PDU of 253
_RTU_BYTES: Final = range(4, 257)  # of a frame on a serial line
_OTHERS: Final = {
    b"\x16\x03": "this is TLS: choose Modbus TCP without security in the client, or the port of a TLS face",
    b"GE": "this is HTTP: the page, where the rig has one, is on a port of its own",
}
"""First bytes of what comes to a port of Modbus TCP by mistake, and what to do."""


class Adu(NamedTuple):
    """One request or answer with its address. A NamedTuple because the server makes one per request."""

    transaction: int
    unit: int
    pdu: bytes


class FramingLost(Exception):  # noqa: N818  no error of ours: the peer does this
    """The stream is not Modbus TCP any more. frames: what was whole before, in order (only from feed)."""

    def __init__(self, sentence: str, frames: tuple[Adu, ...] = ()) -> None:
        super().__init__(sentence)
        self.frames = frames


class MbapFramer:
    """The frames of one direction of one connection. push() then take() until None, or feed() for both."""

    __slots__ = ("_buffer",)

    def __init__(self) -> None:
        self._buffer = bytearray()

    def __len__(self) -> int:
        """Bytes held: whole frames not yet taken and the start of the next."""
        return len(self._buffer)

    def push(self, chunk: bytes | bytearray | memoryview) -> None:
        """Append what has arrived. The caller bounds it: the framer keeps everything that was not taken."""
        self._buffer += chunk

    def take(self) -> Adu | None:
        """Return the next whole frame; None when there is none yet. Raises FramingLost as soon as the header tells."""
        buffer = self._buffer
        if len(buffer) < 6:
            if len(buffer) >= 4 and (buffer[2] or buffer[3]):
                raise _wrong_protocol(buffer)
            return None
        end = 6 + _check_length(buffer)
        if len(buffer) < end:
            return None
        frame = Adu(buffer[0] << 8 | buffer[1], buffer[6], bytes(buffer[7:end]))
        del buffer[:end]
        return frame

    def feed(self, chunk: bytes) -> list[Adu]:
        """Append and take all. Raises FramingLost, which carries the frames before the loss."""
        self.push(chunk)
        frames: list[Adu] = []
        try:
            while (frame := self.take()) is not None:
                frames.append(frame)
        except FramingLost as lost:
            raise FramingLost(str(lost), tuple(frames)) from None
        return frames


def encode(adu: Adu) -> bytes:
    """Return the frame as bytes, either direction. Raises ValueError when the PDU is empty or longer than 253."""
    if not 1 <= len(adu.pdu) <= _LONGEST_LENGTH - 1:
        raise ValueError(f"a PDU has 1 to 253 bytes, not {len(adu.pdu)}")
    return HEADER.pack(adu.transaction, 0, len(adu.pdu) + 1, adu.unit) + adu.pdu


def _check_length(buffer: bytearray) -> int:
    """Bytes after the length field. Raises FramingLost outside 2..254 or when the protocol is another."""
    length = buffer[4] << 8 | buffer[5]
    if buffer[2] or buffer[3]:
        raise _wrong_protocol(buffer)
    if not _SHORTEST_LENGTH <= length <= _LONGEST_LENGTH:
        raise FramingLost(f"length {length}, allowed {_SHORTEST_LENGTH} to {_LONGEST_LENGTH}")
    return length


def _wrong_protocol(buffer: bytearray) -> FramingLost:
    """Say what it is instead, where its bytes tell: the wrong one of a client's settings looks like a broken line."""
    known = _OTHERS.get(bytes(buffer[:2]), "")
    if not known and len(buffer) in _RTU_BYTES and crc16(bytes(buffer)) == 0:
        known = "this is Modbus RTU over TCP: choose Modbus TCP in the client or the serial server"
    return FramingLost(f"protocol id {buffer[2] << 8 | buffer[3]}, Modbus is 0{known and '; '}{known}")
