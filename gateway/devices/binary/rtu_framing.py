"""Modbus RTU between the gateway and a device, both ends: bytes into PDUs and back. Framing as in gateway/modbus/rtu.py.

Our own framing and not a client library's: a library brings its own event loop, retries and times, and the wire of a force
loop has at most one question on it and its own idea of when an answer is late. A test compares each frame with pymodbus's
framer. The end of a frame is found by its length, which its first bytes tell, and proved by its checksum; pauses are not
relied on, because every USB adapter makes and swallows some. Bytes that cannot begin a frame are dropped one by one, so
noise costs the frame that it hit.
"""

from collections.abc import Callable
from typing import Final

from gateway.devices.framing import Line
from gateway.modbus.rtu import LONGEST_ADU, RtuFault, answer_length, decode_adu, encode_adu, request_length

EXCEPTIONS: Final = {
    1: "illegal function",
    2: "illegal data address",
    3: "illegal data value",
    4: "device failure",
    6: "device busy",
}
_EXCEPTION_BIT: Final = 0x80
_QUIET_CHARACTERS: Final = 3.5  # Modbus over serial line V1.02, section 2.5.1.1
_LEAST_QUIET_S: Final = 1.75e-3  # there too: above 19200 baud


def quiet_s(character_s: float) -> float:
    """Return the silence that must part two frames, s. character_s: time of one character."""
    return max(_QUIET_CHARACTERS * character_s, _LEAST_QUIET_S)


def rtu_frame(unit: int, body: bytes) -> bytes:
    """Return the frame of a PDU that is given in hexadecimal digits."""
    return encode_adu(unit, bytes.fromhex(body.decode("ascii")))


def exception_text(body: bytes) -> str:
    """Return an exception answer in words; empty for any other body."""
    if len(body) != 4 or not int(body[:2], 16) & _EXCEPTION_BIT:
        return ""
    code = int(body[2:], 16)
    return f"exception {code} ({EXCEPTIONS.get(code, 'unknown')})"


def exception_body(question: bytes, code: int) -> bytes:
    """Return the exception answer to a question, as digits."""
    return b"%02X%02X" % (int(question[:2], 16) | _EXCEPTION_BIT, code)


class RtuSplitter:
    """Like framing.LineSplitter: feed bytes, get the frames that they complete, each with its PDU in digits as body.

    length_of: whole length of the frame that begins with these bytes, None while that is not known. asked: our own frame,
    which an adapter that hears itself brings back ahead of the answer; read as an answer it may seem to be a much longer one.
    The answer to a setting is often the same bytes: once another question has come back, the first of the two is the echo.
    Else a dead device lived for as long as its setting changed, and we spoke into the answer of a living one. hears_itself:
    so far as that is known.
    """

    def __init__(self, unit: int, length_of: Callable[[bytes], int | None]) -> None:
        self._unit = unit
        self._length_of = length_of
        self._asked = b""
        self.hears_itself = self._is_echo_due = False
        self._buffer = b""
        self._dropped = b""

    @property
    def asked(self) -> bytes:
        """Our own frame, the last."""
        return self._asked

    @asked.setter
    def asked(self, asked: bytes) -> None:
        self._asked, self._is_echo_due = asked, bool(asked)

    @property
    def is_between_lines(self) -> bool:
        """Decide whether nothing is kept: what comes next begins a frame. What is dropped is told when the buffer is empty."""
        return not self._buffer

    def forget(self) -> int:
        """Drop the unfinished frame; how many bytes that was."""
        count = len(self._buffer) + len(self._dropped)
        self._buffer = self._dropped = b""
        return count

    def feed(self, chunk: bytes) -> list[Line]:
        """Return the frames that these bytes complete, and what was dropped before each; an unfinished one waits."""
        self._buffer += chunk
        lines: list[Line] = []
        while len(self._buffer) > 1:
            if self.hears_itself and self._is_echo_due and self._buffer.startswith(self.asked):
                self._buffer, self._is_echo_due = self._buffer[len(self.asked) :], False
                continue
            length = self._frame_length()
            line = self._frame(length) if 0 < length <= len(self._buffer) else None
            if line is not None:
                self.hears_itself = self.hears_itself and not self._is_echo_due
                lines += self._noise()
                lines.append(line)
                self._buffer = self._buffer[length:]
            elif self.asked and self._buffer.startswith(self.asked):
                self._buffer = self._buffer[len(self.asked) :]
                self.hears_itself, self._is_echo_due = True, False
            elif length > len(self._buffer) or self.asked.startswith(self._buffer):
                break
            else:
                self._dropped, self._buffer = self._dropped + self._buffer[:1], self._buffer[1:]
        if len(self._dropped) > LONGEST_ADU or (self._dropped and not self._buffer):
            lines += self._noise()
        return lines

    def _frame_length(self) -> int:
        """Length of the frame that begins here; 0 where none can begin, more than there is while that is not known."""
        if self._buffer[1] & ~_EXCEPTION_BIT not in _FUNCTIONS:
            return 0
        length = self._length_of(self._buffer)
        if length is None:
            return len(self._buffer) + 1 if len(self._buffer) < _KNOWN_BYTES else 0
        return length

    def _frame(self, length: int) -> Line | None:
        data = self._buffer[:length]
        try:
            unit, pdu = decode_adu(data)
        except RtuFault:
            return None
        return Line(data, pdu.hex().upper().encode("ascii"), unit == self._unit)

    def _noise(self) -> list[Line]:
        noise, self._dropped = self._dropped, b""
        return [Line(noise, b"", False)] if noise else []


_FUNCTIONS: Final = (1, 2, 3, 4, 5, 6, 15, 16)
_KNOWN_BYTES: Final = 7  # of a request; then its length is known, or there is none


def answers(unit: int) -> RtuSplitter:
    """Return what finds a device's answers among bytes."""
    return RtuSplitter(unit, answer_length)


def requests(unit: int) -> RtuSplitter:
    """Return what finds the requests to a device among bytes."""
    return RtuSplitter(unit, request_length)
