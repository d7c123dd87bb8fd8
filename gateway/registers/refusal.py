"""Why a request was not executed: a Modbus exception for the master, a number for the registers, a sentence for people.

Sentences begin with the code that `force-gateway explain` expands: what was seen, in numbers, then what it probably is.
"""

from math import nan
from typing import Final

from gateway.modbus import Fault, ModbusError, RequestError
from gateway.modbus.errors import (
    BUSY,
    DEVICE_FAILURE,
    ILLEGAL_ADDRESS,
    ILLEGAL_FUNCTION,
    ILLEGAL_VALUE,
    TARGET_SILENT,
)
from gateway.registers.words import RefusalReason

_WIRE: Final = {
    RefusalReason.ADDRESS: (ILLEGAL_ADDRESS, "W202"),
    RefusalReason.READ_ONLY: (ILLEGAL_ADDRESS, "W205"),
    RefusalReason.HALF_VALUE: (ILLEGAL_VALUE, "W206"),
    RefusalReason.NOT_FINITE: (ILLEGAL_VALUE, "W207"),
    RefusalReason.OUT_OF_RANGE: (ILLEGAL_VALUE, "W204"),
    RefusalReason.WORDS_SWAPPED: (ILLEGAL_VALUE, "W201"),
    RefusalReason.TOO_SMALL: (ILLEGAL_VALUE, "W208"),
    RefusalReason.RESERVED: (ILLEGAL_VALUE, "W209"),
    RefusalReason.NOT_OWNER: (BUSY, "W210"),
    RefusalReason.ROLE: (ILLEGAL_FUNCTION, "W211"),  # as Modbus/TCP Security answers a role that may not
    RefusalReason.FAULT_LATCHED: (DEVICE_FAILURE, "W212"),
    RefusalReason.NOT_READY: (BUSY, "W213"),
    RefusalReason.OUTPUT_FAULT: (DEVICE_FAILURE, "W214"),
    RefusalReason.CELL_SILENT: (TARGET_SILENT, "W215"),
    RefusalReason.RESET_NEEDS_ZERO: (ILLEGAL_VALUE, "W216"),
    RefusalReason.UNSUPPORTED_BIT: (ILLEGAL_VALUE, "W217"),
    RefusalReason.BYTE_ORDER_UNPROVEN: (BUSY, "W218"),
    RefusalReason.BUSY: (BUSY, "W219"),
    RefusalReason.QUANTITY: (ILLEGAL_VALUE, "W220"),
    RefusalReason.FUNCTION: (ILLEGAL_FUNCTION, "W221"),
    RefusalReason.COEFFICIENTS: (BUSY, "E401"),
    RefusalReason.HEARTBEAT_STALE: (ILLEGAL_VALUE, "W302"),
    RefusalReason.NOTHING_TO_RESET: (DEVICE_FAILURE, "W312"),
    RefusalReason.TARE_REFUSED: (DEVICE_FAILURE, "W303"),
    RefusalReason.CALIBRATION_REFUSED: (DEVICE_FAILURE, "W305"),
    RefusalReason.CALIBRATING: (BUSY, "W310"),
    RefusalReason.FITTING: (BUSY, "W311"),
    RefusalReason.CALIBRATION_HELD: (DEVICE_FAILURE, "W313"),
    RefusalReason.STOPPING: (BUSY, "W315"),
    RefusalReason.EMPTY_SLOT: (ILLEGAL_VALUE, "W331"),
    RefusalReason.UNIT: (TARGET_SILENT, "W222"),
}
"""Exception code and message code of every reason; a reason without an entry cannot refuse."""

OFF_BY_ONE: Final = "W203"
NO_ADDRESS: Final = 0xFFFF
"""In refusal_address: the request has no address."""

_REQUEST_FAULTS: Final = {
    Fault.FUNCTION: (RefusalReason.FUNCTION, "W221"),
    Fault.QUANTITY: (RefusalReason.QUANTITY, "W220"),
    Fault.VALUE: (RefusalReason.OUT_OF_RANGE, "W223"),
    Fault.OBJECT: (RefusalReason.ADDRESS, "W224"),
    Fault.UNIT: (RefusalReason.UNIT, "W222"),
}


class Refusal(ModbusError):  # noqa: N818  the glossary's word
    """address: 0-based, of the first word concerned; value: in the register's unit, NaN where there is none."""

    def __init__(
        self, reason: RefusalReason, address: int, text: str, *, value: float = nan, label: str | None = None
    ) -> None:
        code, usual_label = _WIRE[reason]
        self.reason = reason
        self.address = address
        self.value = value
        self.sentence = f"{label or usual_label} {text}"
        super().__init__(code, self.sentence)


def request_refusal(error: RequestError) -> Refusal:
    """What the protocol's own rules have refused, in the words of the registers and the log."""
    reason, label = _REQUEST_FAULTS[error.fault]
    address = NO_ADDRESS if error.address is None else error.address
    where = "" if error.address is None else f" at address {error.address}"
    return Refusal(reason, address, f"{error}{where}", value=error.value, label=label)


def quantity(value: float, decimals: int, unit: str) -> str:
    """`12.00 N`; numbers that those digits would hide or swell are written as `2.34e-41 N`."""
    usual = value == 0.0 or 1.0e-3 <= abs(value) < 1.0e7
    number = f"{value:.{decimals}f}" if usual else f"{value:.3g}"
    return f"{number} {unit}".rstrip()


def allowed_range(low: float, high: float, unit: str) -> str:
    """`0 .. 60 N`."""
    return f"{low:g} .. {high:g} {unit}".rstrip()
