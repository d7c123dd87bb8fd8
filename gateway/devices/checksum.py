"""Checksums by name, appended to a sentence before its terminator."""

from collections.abc import Callable
from functools import reduce
from operator import xor
from typing import Final, Literal

ChecksumName = Literal["none", "dcon-sum", "sum-complement", "sum-decimal", "xor", "xor-hex", "xor-stx-etx"]


def _nothing(body: bytes) -> bytes:
    return b""


def _dcon_sum(body: bytes) -> bytes:
    """Sum of the character codes modulo 256, two upper-case hex digits (ICP DAS 7000 series manuals)."""
    return b"%02X" % (sum(body) % 256)


def _sum_complement(body: bytes) -> bytes:
    """What makes the sum of the character codes 0 modulo 256, two upper-case hex digits (Flintec FT-10, page 46)."""
    return b"%02X" % (-sum(body) % 256)


def _sum_decimal(body: bytes) -> bytes:
    """Sum of the character codes modulo 100, two decimal digits (General Measure M02, page 37: of all from STX on)."""
    return b"%02d" % (sum(body) % 100)


def _xor(body: bytes) -> bytes:
    """Exclusive or of all characters behind a leading `$`, after a star, as NMEA 0183 does."""
    return b"*%02X" % reduce(xor, body.removeprefix(b"$"), 0)


def _xor_hex(body: bytes) -> bytes:
    r"""Exclusive or of what stands between the signs that frame a sentence, as two digits: a leading STX (Yaohua XK3190-A23p,
    page 24), `&` or `$`, and a `\` behind (Laumas TLB and TLU: continuous transmission, ASCII questions), are left out."""
    inner = body[1:] if body[:1] in (b"\x02", b"&", b"$") else body
    return b"%02X" % reduce(xor, inner.removesuffix(b"\\"), 0)


def _xor_stx_etx(body: bytes) -> bytes:
    """Exclusive or of what stands between STX and ETX, as two digits behind both (Pavone DAT 200, pages 22 and 24)."""
    return b"%02X" % reduce(xor, body.removeprefix(b"\x02").removesuffix(b"\x03"), 0)


_TRAILERS: Final[dict[ChecksumName, Callable[[bytes], bytes]]] = {
    "none": _nothing,
    "dcon-sum": _dcon_sum,
    "sum-complement": _sum_complement,
    "sum-decimal": _sum_decimal,
    "xor": _xor,
    "xor-hex": _xor_hex,
    "xor-stx-etx": _xor_stx_etx,
}


_LENGTHS: Final = {name: len(trailer(b"")) for name, trailer in _TRAILERS.items()}


def add_checksum(body: bytes, name: ChecksumName) -> bytes:
    """Return the sentence with its checksum behind it."""
    return body + _TRAILERS[name](body)


def strip_checksum(sentence: bytes, name: ChecksumName) -> bytes | None:
    """Return the sentence without its checksum, None when that is missing or wrong."""
    body = sentence[: len(sentence) - _LENGTHS[name]]
    return body if add_checksum(body, name) == sentence else None
