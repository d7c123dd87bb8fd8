"""Why a request was not executed: a Modbus exception for the master, a number for the registers, a sentence for people.

Sentences begin with the code that `force-gateway explain` expands: what was seen, in numbers, then what it probably is.
"""

from math import nan
from typing import Final

from gateway.codes.refusals import NO_SUCH_OBJECT, NOT_A_COIL_VALUE, RefusalReason, SpecialRefusal
from gateway.modbus import ModbusError, RequestError, RequestFault

NO_ADDRESS: Final = 0xFFFF
"""In refusal_address: the request has no address."""

_REQUEST_FAULTS: Final[dict[RequestFault, RefusalReason | SpecialRefusal]] = {
    RequestFault.FUNCTION: RefusalReason.FUNCTION,
    RequestFault.QUANTITY: RefusalReason.QUANTITY,
    RequestFault.VALUE: NOT_A_COIL_VALUE,
    RequestFault.OBJECT: NO_SUCH_OBJECT,
    RequestFault.UNIT: RefusalReason.UNIT,
    RequestFault.ECHO: RefusalReason.BUSY,
}


class Refusal(ModbusError):  # noqa: N818  the glossary's word
    """address: 0-based, of the first word concerned; value: in the register's unit, NaN where there is none."""

    def __init__(self, cause: RefusalReason | SpecialRefusal, address: int, text: str, *, value: float = nan) -> None:
        self.reason = cause if isinstance(cause, RefusalReason) else cause.reason
        self.address = address
        self.value = value
        self.sentence = f"{cause.explanation.code} {text}"
        super().__init__(self.reason.exception, self.sentence)


def request_refusal(error: RequestError) -> Refusal:
    """Return what the protocol's own rules have refused, in the words of the registers and the log."""
    address = NO_ADDRESS if error.address is None else error.address
    where = "" if error.address is None else f" at address {error.address}"
    return Refusal(_REQUEST_FAULTS[error.fault], address, f"{error}{where}", value=error.value)


def quantity(value: float, decimals: int, unit: str) -> str:
    """Return `12.00 N`; numbers that those digits would hide or swell are written as `2.34e-41 N`."""
    usual = value == 0.0 or 1.0e-3 <= abs(value) < 1.0e7
    number = f"{value:.{decimals}f}" if usual else f"{value:.3g}"
    return f"{number} {unit}".rstrip()


def allowed_range(low: float, high: float, unit: str) -> str:
    """Return `0 .. 60 N`."""
    return f"{low:g} .. {high:g} {unit}".rstrip()
