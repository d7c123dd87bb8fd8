"""Faces of a gateway beside plain Modbus TCP: the entries of `fieldbus:` in a rig file, told apart by their `type`.

A further kind is one more dataclass here and one more member of `Face`, with its own word as `type`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, ClassVar, Final, Literal

from annotated_types import Ge, Le, MinLen
from pydantic import AfterValidator, Field, WithJsonSchema

from gateway import defaults
from gateway.defaults import STRICT
from gateway.devices.line_settings import Baud, Parity, SerialSettings
from gateway.modbus.rtu import LARGEST_UNIT, silence_s
from gateway.plain_file import expand_home
from gateway.profiles.rigs.addresses import BindAddress, Network4Or6

_OF_TLS: Final = ("bind", "certificate", "key", "ca", "allow", "revoked")
_OF_RTU: Final = ("baud", "parity", "stop_bits", "unit", "role")
_FC23_BYTES: Final = 18  # beside its words: 13 of the request, 5 of the answer


def _rtu_unit(unit: int) -> int:
    allowed = f"a server on a serial line has 1 to {LARGEST_UNIT}"
    if unit == 0:
        raise ValueError(f"0 is the broadcast of Modbus RTU, which everybody obeys and nobody answers: {allowed}")
    if not 1 <= unit <= LARGEST_UNIT:
        raise ValueError(f"{unit} is no unit id of Modbus RTU: {allowed}")
    return unit


RtuUnit = Annotated[
    int,
    AfterValidator(_rtu_unit),
    WithJsonSchema({"type": "integer", "minimum": 1, "maximum": LARGEST_UNIT}),
]


@dataclass(frozen=True, slots=True, kw_only=True)
class RtuFace:
    """Modbus RTU on a serial port, RS-485 or RS-232: a server with one unit id."""

    KEPT_ELSEWHERE: ClassVar[Mapping[str, str]] = dict.fromkeys(_OF_TLS, "to a face of `type: tls`")
    __pydantic_config__ = STRICT
    type: Literal["rtu"]  # Modbus RTU on a serial port
    port: Annotated[str, MinLen(1)] | None = None  # /dev/serial/by-id/...; absent in a simulated rig: a pseudo-terminal
    baud: Baud = defaults.RTU_BAUD  # as set in the master
    parity: Parity = defaults.RTU_PARITY  # as set in the master
    stop_bits: Literal[1, 2] = 1  # as set in the master
    unit: RtuUnit = defaults.UNIT_ID  # the id that is answered; others are left alone without a byte
    role: Literal["monitor", "setpoint", "calibration"] | None = (
        None  # what masters on this line may do; null: as on plain Modbus TCP
    )

    @property
    def settings(self) -> SerialSettings:
        """The serial line's settings; a character of Modbus RTU has eight bits."""
        return SerialSettings(baud=self.baud, parity=self.parity, stop_bits=self.stop_bits)

    def exchange_s(self, words: int) -> float:
        """Return how long one FC23 with so many words, written and read together, keeps the line, s: both frames and the
        silence behind each. What the master and its adapter take comes on top."""
        character_s = self.settings.character_s
        return (_FC23_BYTES + 2 * words) * character_s + 2.0 * silence_s(self.baud, character_s)


def _serial_number(text: str) -> str:
    number = text.replace(":", "").upper()
    if not number or number.strip("0123456789ABCDEF"):
        raise ValueError(f'"{text}" is no serial number in hex, as `openssl x509 -noout -serial -in FILE` prints it')
    number = number.lstrip("0") or "0"  # browsers show the zeros before it
    return number.zfill(len(number) + len(number) % 2)


SerialNumber = Annotated[str, AfterValidator(_serial_number)]
FilePath = Annotated[str, MinLen(1)]


@dataclass(frozen=True, slots=True, kw_only=True)
class TlsFace:
    """Modbus/TCP Security: Modbus TCP by TLS 1.2 or 1.3, both sides with certificates, the role out of the client's."""

    KEPT_ELSEWHERE: ClassVar[Mapping[str, str]] = dict.fromkeys(_OF_RTU, "to a face of `type: rtu`")
    __pydantic_config__ = STRICT
    type: Literal["tls"]  # Modbus TCP by TLS
    bind: BindAddress = defaults.HOST  # the gateway's own address; any but loopback needs `allow`
    port: Annotated[int, Ge(0), Le(65535)] = defaults.TLS_PORT  # 0: any free port; below 1024 needs a privilege
    certificate: FilePath  # the gateway's own, PEM; a path from this file, as the next two
    key: FilePath  # its private key, PEM, readable by its owner only
    ca: FilePath  # certificate of the CA that has signed the clients' certificates, PEM
    allow: tuple[Network4Or6, ...] = ()  # networks that may connect, such as 192.168.125.0/24
    revoked: tuple[SerialNumber, ...] = ()  # serial numbers of certificates that may no longer connect, in hex

    def within(self, folder: Path) -> "TlsFace":
        """Return the face with its paths taken from this folder, that of its rig file."""
        certificate, key, ca = (str(folder / expand_home(name)) for name in (self.certificate, self.key, self.ca))
        return replace(self, certificate=certificate, key=key, ca=ca)


Face = Annotated[RtuFace | TlsFace, Field(discriminator="type")]
