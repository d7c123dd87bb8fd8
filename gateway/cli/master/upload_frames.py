"""An upload as the Modbus requests that make it, for our own master and for those who program a PLC.

FC16 in five requests: head with the rising branch, the falling branch with limits and span, slip stops and response, the
trailer with length, CRC and slot, the commit. The last two are apart so that a PLC that resends one part never commits
half a set. All places of each array are written, unused ones as 0, for an earlier upload may have left something there.
With FC06 each word is a request of its own; the words that no register has stay out.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby
from typing import Any, Final

from gateway.bsfm import Calibration
from gateway.bsfm.slip.slip_stops import STOPS_CARRIED
from gateway.modbus.mbap import Adu, encode
from gateway.modbus.pdu import (
    READ_HOLDING_REGISTERS,
    WRITE_REGISTER,
    WRITE_REGISTERS,
    read_request,
    write_register_request,
    write_registers_request,
)
from gateway.modbus.rtu import encode_adu
from gateway.registers import Register, RegisterMap
from gateway.registers.map.register_map import holding_number
from gateway.registers.upload.coefficients import HEAD_BYTES, SET_WORDS, TAIL_FROM, CoefficientSet, set_crc
from gateway.registers.words import CommitAction

_PER_LINE: Final = 32  # bytes of a frame in one line of text
Words = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Request:
    """One request. words: what is written; count: words to be read, 0 for a write."""

    text: str
    function: int
    address: int
    words: Words = ()
    count: int = 0

    @property
    def pdu(self) -> bytes:
        """Bytes of the request without framing."""
        if self.function == READ_HOLDING_REGISTERS:
            return read_request(self.function, self.address, self.count)
        if self.function == WRITE_REGISTER:
            return write_register_request(self.address, self.words[0])
        return write_registers_request(self.address, struct.pack(f">{len(self.words)}H", *self.words))

    def frame(self, transaction: int, unit: int, *, is_serial: bool) -> bytes:
        """Return the request as it goes over TCP, or over a serial line, which has no transactions."""
        return encode_adu(unit, self.pdu) if is_serial else encode(Adu(transaction, unit, self.pdu))


@dataclass(frozen=True, slots=True)
class UploadFrames:
    """All requests of an upload.

    set_words: what the active block must read back; commit is the last request; poll is repeated until commit_status tells
    the end.
    """

    set_words: bytes
    staging: tuple[Request, ...]
    commit: Request
    poll: Request

    @property
    def requests(self) -> tuple[Request, ...]:
        """Staging, then the commit."""
        return (*self.staging, self.commit)


def upload_of(
    calibration: Calibration, register_map: RegisterMap, *, slot: int, action: CommitAction, fc06: bool
) -> UploadFrames:
    """Return the requests that stage a calibration and then act. ValueError for more slip stops than the registers carry."""
    if (stops := len(calibration.slip_radii_v)) > STOPS_CARRIED:
        raise ValueError(f"{calibration.name} has {stops} slip stops, the registers carry {STOPS_CARRIED}")
    words = CoefficientSet.of_calibration(calibration).to_words()
    trailer = struct.pack(">H2xIH", SET_WORDS, set_crc(words), slot)
    commit_address = register_map.find("commit").address
    commit = (action.value,)
    text = "commit: check, store and use" if action is CommitAction.COMMIT else "commit word 2: check only"
    parts = tuple(_parts(words, trailer, register_map))
    return UploadFrames(
        words,
        tuple(_single(parts, register_map)) if fc06 else parts,
        Request(text, WRITE_REGISTER if fc06 else WRITE_REGISTERS, commit_address, commit),
        Request(
            "commit_status, failing_index, failing_reason: until status is 3 or 4 (0 after a check only)",
            READ_HOLDING_REGISTERS,
            register_map.find("commit_status").address,
            count=3,
        ),
    )


def _parts(words: bytes, trailer: bytes, register_map: RegisterMap) -> Iterator[Request]:
    """Yield the FC16 of the staging, the trailer last."""
    first = register_map.find("order@staging").address
    falling = register_map.find("falling_b_0@staging").address
    head, tail, half = words[:HEAD_BYTES], words[HEAD_BYTES:], 2 * (falling - first)
    yield Request("order, range, rising branch", WRITE_REGISTERS, first, _words(head[:half]))
    yield Request("falling branch, force limits, blend span", WRITE_REGISTERS, falling, _words(head[half:]))
    yield Request("slip stops, response", WRITE_REGISTERS, first + TAIL_FROM, _words(tail))
    trailer_at = register_map.find("length@staging").address
    yield Request("length, CRC-32, target slot", WRITE_REGISTERS, trailer_at, _words(trailer))


def _single(parts: tuple[Request, ...], register_map: RegisterMap) -> Iterator[Request]:
    """Word by word."""
    names = register_names(register_map)
    for part in parts:
        for address, word in enumerate(part.words, part.address):
            if address in names:
                yield Request(names[address], WRITE_REGISTER, address, (word,))


def register_names(register_map: RegisterMap) -> dict[int, str]:
    """Return what each address of the staging block holds; halves of a float32 are told apart."""
    names = {}
    for register in register_map.registers_of("staging"):
        for place in range(register.words):
            half = "" if register.words == 1 else (" high word", " low word")[place]
            names[register.address + place] = register.name + half
    return names


def listing(upload: UploadFrames, register_map: RegisterMap, unit: int, *, is_serial: bool) -> Iterator[str]:
    """Yield every request as text: function, address, frame in hexadecimal, and for FC16 each register with its value."""
    requests = (*upload.requests, upload.poll)
    for number, request in enumerate(requests, 1):
        yield f"frame {number} of {len(requests)}  {_title(request)}: {request.text}"
        frame = request.frame(number, unit, is_serial=is_serial)
        for at in range(0, len(frame), _PER_LINE):
            yield f"    {frame[at : at + _PER_LINE].hex(' ').upper()}"
        if request.function == WRITE_REGISTERS:
            yield from _values(request, register_map)


def facts(upload: UploadFrames, unit: int, *, is_serial: bool) -> list[dict[str, Any]]:
    """Return every request as JSON objects, for --json."""
    return [
        {
            "text": request.text,
            "function": request.function,
            "address": request.address,
            "words": list(request.words),
            "count": request.count,
            "frame": request.frame(number, unit, is_serial=is_serial).hex(" "),
        }
        for number, request in enumerate((*upload.requests, upload.poll), 1)
    ]


def _title(request: Request) -> str:
    count = request.count or len(request.words)
    what = "read" if request.count else "write"
    words = "1 word" if count == 1 else f"{count} words"
    return f"FC{request.function:02d} {what} {words} at {request.address} ({holding_number(request.address)})"


def _values(request: Request, register_map: RegisterMap) -> Iterator[str]:
    """Yield each register with its value; neighbours of an array that are 0 in one line."""
    own = [register for register in register_map.registers_of("staging") if _within(register, request)]
    for is_zero, group in groupby(own, lambda register: "_" in register.name and not any(_own(register, request))):
        registers = list(group)
        if is_zero and len(registers) > 1:
            first, last = registers[0], registers[-1]
            yield f"    {first.address}  0000 x {2 * len(registers):<3} {first.name} .. {last.name} = 0"
            continue
        for register in registers:
            words = _own(register, request)
            yield f"    {register.address}  {' '.join(f'{word:04X}' for word in words):<9}  {_describe_value(register, words)}"


def _within(register: Register, request: Request) -> bool:
    return request.address <= register.address < request.address + len(request.words)


def _own(register: Register, request: Request) -> Words:
    start = register.address - request.address
    return request.words[start : start + register.words]


def _describe_value(register: Register, own: Words) -> str:
    value = register.decode(struct.pack(f">{len(own)}H", *own))
    number = f"0x{int(value):08X}" if register.name == "crc32" else f"{value:.9g}"
    return f"{register.name} = {number} {register.unit}".rstrip()


def _words(data: bytes) -> Words:
    return struct.unpack(f">{len(data) // 2}H", data)
