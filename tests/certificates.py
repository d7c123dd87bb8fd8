"""Certificates for tests, made once: a CA, another CA, a gateway's, and clients as they should and should not be."""

import functools
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cryptography import x509

from gateway.cli.setup import certificates as made
from gateway.modbus import Role

DAYS = 10


@dataclass(frozen=True)
class Folder:
    """Files NAME.crt and NAME.key."""

    path: Path

    def crt(self, name: str) -> str:
        return str(self.path / f"{name}.crt")

    def key(self, name: str) -> str:
        return str(self.path / f"{name}.key")


@functools.cache
def signed() -> dict[str, Any]:
    """Name -> certificate with its key."""
    ca, other = made.make_ca(DAYS), made.make_ca(DAYS)
    return {
        "ca": ca,
        "other-ca": other,
        "gateway": made.make_server(ca, ("127.0.0.1", "localhost"), DAYS),
        "expired-gateway": made.make_server(ca, ("127.0.0.1",), -1),
        **{role.name.lower(): made.make_client(ca, role.name.lower(), role, DAYS) for role in Role},
        "foreign": made.make_client(other, "foreign", Role.SETPOINT, DAYS),
        "expired": made.make_client(ca, "expired", Role.SETPOINT, -1),
        "roleless": made.make_client(ca, "roleless", "", DAYS),
        "captain": made.make_client(ca, "captain", "captain", DAYS),
        "nameless": made.make_client(ca, " ", Role.SETPOINT, DAYS),
        "thief": made.make_client(ca, "thief", Role.ADMIN, DAYS),
    }


def serial_of(name: str) -> str:
    certificate: x509.Certificate = signed()[name].certificate
    number = f"{certificate.serial_number:X}"
    return number.zfill(len(number) + len(number) % 2)  # as openssl prints it


def store_all(folder: Path) -> Folder:
    """Write all of them, once for each folder."""
    for name, each in signed().items():
        made.store({name: each}, folder)
    return Folder(folder)
