"""A Modbus exception in words: what was refused, why, and what to do, from the gateway's last-refusal registers."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from gateway.cli.client import Frame, GatewayClient, Reading, RefusedError
from gateway.cli.codes import CATALOGUE, REFUSAL_CODES
from gateway.cli.errors import CliError
from gateway.registers.words import RefusalReason

EXCEPTIONS: Final = {
    0x01: "function not served",
    0x02: "no such address",
    0x03: "value refused",
    0x04: "output or device fault",
    0x05: "accepted, still working",
    0x06: "busy, or owned by another master",
    0x0A: "gateway path unavailable",
    0x0B: "serial device or unit silent",
}
_LAST_REFUSAL: Final = ("refusal_address", "refusal_reason", "refusal_value")


@contextmanager
def explained(client: GatewayClient, frames: "list[Frame] | None" = None) -> Iterator[None]:
    """Turns a Modbus exception into one message, exit code 1. frames: what is being written, if anything."""
    try:
        yield
    except RefusedError as refused:
        raise CliError(_message(client, refused, frames or [])) from None


def _message(client: GatewayClient, refused: RefusedError, frames: list[Frame]) -> str:
    exception = f"exception {refused.code:02X} ({EXCEPTIONS.get(refused.code, 'not a known exception')})"
    reason, where = _last_refusal(client, frames)
    code = REFUSAL_CODES.get(reason)
    if code is None:
        return f"{exception} to {refused.request}"
    entry = CATALOGUE[code]
    return (
        f"{code} {entry.title}: {exception} to {refused.request}; {where}\n  {entry.do} (force-gateway explain {code})"
    )


def _last_refusal(client: GatewayClient, frames: list[Frame]) -> tuple[RefusalReason, str]:
    """Reason and place of the last refusal; NONE where the server has no such registers or they tell of another request."""
    try:
        address, reason, value = client.read_values([client.register_map.find(name) for name in _LAST_REFUSAL])
        kind = RefusalReason(int(reason.value))
    except (CliError, RefusedError, LookupError, ValueError):
        return RefusalReason.NONE, ""
    at = int(address.value)
    if not any(frame.address <= at < frame.address + len(frame.words) for frame in frames):
        return RefusalReason.NONE, ""
    return kind, f"{_place(client, at, value)}, {kind.name.lower().replace('_', ' ')}"


def _place(client: GatewayClient, address: int, value: Reading) -> str:
    """`force_setpoint = 65 N (address 1)`; without a value where the gateway has none."""
    for register in client.register_map.registers:
        if register.address <= address < register.address + register.words:
            number = f" = {value.value:.9g} {register.unit}".rstrip() if value.is_available else ""
            return f"{register.name}{number} (address {address})"
    return f"address {address}"
