"""The exception of an answer: one number on the wire, one sentence for people.

Numbers are those of "MODBUS Application Protocol Specification V1.1b3", section 7. Anything else that escapes a bank is
an internal error and is deliberately not turned into an exception answer here (it goes to the safe voltage instead).
"""

from enum import Enum
from typing import Final

ILLEGAL_FUNCTION: Final = 0x01
ILLEGAL_ADDRESS: Final = 0x02
ILLEGAL_VALUE: Final = 0x03
DEVICE_FAILURE: Final = 0x04
BUSY: Final = 0x06
TARGET_SILENT: Final = 0x0B

NAMES: Final = {
    ILLEGAL_FUNCTION: "function not served",
    ILLEGAL_ADDRESS: "no such address",
    ILLEGAL_VALUE: "value refused",
    DEVICE_FAILURE: "device or state forbids it",
    0x05: "accepted, still working",
    BUSY: "busy, or owned by another master",
    0x0A: "gateway path unavailable",
    TARGET_SILENT: "serial device or unit silent",
}
"""What each exception code means; 05 and 0A this gateway never sends, other servers do."""


class ModbusError(Exception):
    """A request answered with an exception. code: 1, 2, 3, 4, 6 or 0x0B when we send it; any byte when received."""

    def __init__(self, code: int, sentence: str = "") -> None:
        super().__init__(sentence or NAMES.get(code, f"exception {code}"))
        self.code = code


class RequestFault(Enum):
    """Fault of a request that no bank has to look at, and the exception code that answers it."""

    FUNCTION = "function", ILLEGAL_FUNCTION
    QUANTITY = "quantity", ILLEGAL_VALUE  # a count, a byte count or a length that the specification does not allow
    VALUE = "value", ILLEGAL_VALUE
    OBJECT = "object", ILLEGAL_ADDRESS  # of a device identification
    UNIT = "unit", TARGET_SILENT
    ECHO = "echo", BUSY  # of a serial line: it may be our own answer that has come back

    @property
    def code(self) -> int:
        """Return the exception code that Modbus gives this fault."""
        return int(self.value[1])


class RequestError(ModbusError):
    """A request refused by the rules of the protocol alone; the bank is told, so that its reason can be read.

    value: the function, quantity, byte count, word or unit id that is refused. address: 0-based, None where the request
    has none. is_write: of a request that wanted to write.
    """

    def __init__(self, fault: RequestFault, sentence: str, value: int, address: int | None = None) -> None:
        super().__init__(fault.code, sentence)
        self.fault = fault
        self.value = value
        self.address = address
        self.is_write = False
