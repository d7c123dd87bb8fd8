"""What diagnostic blocks ask first: FC08 sub-function 0, return query data (V1.1b3 section 6.8), and FC17, report server
id (section 6.13).

Of FC08 no other sub-function is served: they count frames and restart ports, which Modbus TCP does not have. The answer of
FC17 is what most devices and libmodbus send: one byte of server id, the run indicator, then text. pymodbus takes the last
byte for the run indicator, where the specification leaves the text to the device; so ours ends with it once more.
"""

from typing import Final, NamedTuple

from gateway.modbus.errors import RequestError, RequestFault
from gateway.modbus.pdu import DIAGNOSTICS, REPORT_SERVER, wrong_length

RETURN_QUERY_DATA: Final = 0
RUNNING: Final = 0xFF
STOPPED: Final = 0x00

_MOST_TEXT: Final = 253 - 5  # a PDU less function, byte count, id, and the run indicator twice


class ServerId(NamedTuple):
    """number: 0..255, the device's own; text: product, version and so on."""

    number: int
    is_running: bool
    text: bytes


def loopback_answer(pdu: bytes) -> bytes:
    """Return the request itself. RequestError: 01 other sub-functions, 03 half a word."""
    if len(pdu) < 3 or len(pdu) % 2 == 0:
        raise wrong_length(pdu, "a diagnostic request has a sub-function and whole words")
    function = int.from_bytes(pdu[1:3], "big")
    if function != RETURN_QUERY_DATA:
        raise RequestError(RequestFault.FUNCTION, f"function 8 with sub-function {function}, served is 0", DIAGNOSTICS)
    return pdu


def report_answer(pdu: bytes, server: ServerId) -> bytes:
    """Return the FC17 answer: byte count, server id, run indicator, text.
    RequestError: 03 for a request with surplus bytes."""
    if len(pdu) != 1:
        raise wrong_length(pdu, "report server id has 1")
    run = RUNNING if server.is_running else STOPPED
    body = bytes((server.number, run)) + server.text[:_MOST_TEXT] + bytes((run,))
    return bytes((REPORT_SERVER, len(body))) + body
