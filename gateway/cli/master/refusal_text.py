"""A Modbus exception in words: what was refused, why, and what to do, from the gateway's last-refusal registers.

A gateway on this machine is asked for its own sentence too, which holds the numbers; it counts only where it tells of the same
refusal as the registers.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from gateway.cli.errors import CliError
from gateway.cli.master.client import Frame, GatewayClient, RefusedError, RegisterReading
from gateway.cli.master.value_text import format_value
from gateway.codes.refusals import RefusalReason
from gateway.modbus.errors import NAMES, TARGET_SILENT
from gateway.registers.refusal import NO_ADDRESS
from gateway.registers.words import State

_OF_RUNS: Final = (RefusalReason.SELF_TEST_REFUSED, RefusalReason.CALIBRATION_REFUSED)
_LAST_REFUSAL: Final = ("refusal_address", "refusal_reason", "refusal_value")


@contextmanager
def explain_refusals(
    client: GatewayClient, frames: "list[Frame] | None" = None, state: Path | None = None
) -> Iterator[None]:
    """Turn a Modbus exception into one message, exit code 1. frames: what is being written, if anything; state: directory
    of the gateway, where it is on this machine and not among the usual ones."""
    try:
        yield
    except RefusedError as refused:
        raise CliError(_message(client, refused, frames or [], state)) from None


def _message(client: GatewayClient, refused: RefusedError, frames: list[Frame], state: Path | None) -> str:
    exception = f"exception {refused.code:02X} ({NAMES.get(refused.code, 'not a known exception')})"
    reason, at, where = _last_refusal(client, frames)
    if reason is RefusalReason.NONE:
        return f"{exception} to {refused.request}"
    entry = reason.explanation
    own = _own_sentence(client, at, reason, state).removeprefix(f"{entry.code} ")
    own = own or _known_limit(client, at, reason) or _known_state(client, reason)
    values = f"{entry.title}: {exception} to {refused.request}; {where}"
    cure = f"{entry.do} (force-gateway explain {entry.code})"
    return "\n  ".join([f"{entry.code} {own}", values, cure] if own else [f"{entry.code} {values}", cure])


def _known_limit(client: GatewayClient, address: int, reason: RefusalReason) -> str:
    """Return what the registers tell of a limit where the gateway is elsewhere: the calibration's force, if it was that."""
    register = client.register_map.find("force_setpoint")
    if reason is not RefusalReason.OUT_OF_RANGE or address != register.address:
        return ""
    try:
        names = ("refusal_value", "force_low@active", "force_high@active")
        value, low, high = client.read_values([client.register_map.find(name) for name in names])
    except (CliError, RefusedError, LookupError):
        return ""
    if not high.is_available or high.value <= 0.0:
        return ""
    asked = f"force_setpoint = {value.value:.2f} N"
    if not 0.0 <= value.value <= high.value:
        return f"{asked}: allowed 0 .. {high.value:.4g} N by the calibration in use; the rig's own limit may be lower"
    if low.is_available and 0.0 < value.value < low.value:
        return f"{asked}: the calibration in use is for {low.value:.4g} N and more; 0 is taken"
    return f"{asked}: beyond the rig's own limit, which no register tells; the calibration in use goes to {high.value:.4g} N"


def _known_state(client: GatewayClient, reason: RefusalReason) -> str:
    """Return which state keeps a run from beginning, where the gateway is elsewhere; empty where it is not the state."""
    if reason not in _OF_RUNS:
        return ""
    try:
        (state,) = client.read_values([client.register_map.find("state")])
    except (CliError, RefusedError, LookupError):
        return ""
    is_told = state.is_available and state.value != State.OFF
    return f"{reason.explanation.title}: state {format_value(state)}" if is_told else ""


def _own_sentence(client: GatewayClient, address: int, reason: RefusalReason, state: Path | None) -> str:
    """Return what the gateway itself has said to this refusal; empty where it is elsewhere, or nobody answers."""
    from gateway.cli.control_socket import ask
    from gateway.cli.master.local_gateways import sockets_near, usual_root

    states = [state] if state else sockets_near(client.wire, usual_root())
    for directory in states:
        try:
            sentence = ask(directory, {"do": "last-refusal"})
        except CliError:
            continue
        if (sentence.get("address"), sentence.get("reason")) == (address, int(reason)):
            return str(sentence["sentence"])
    return ""


def _last_refusal(client: GatewayClient, frames: list[Frame]) -> tuple[RefusalReason, int, str]:
    """Reason, address and place in words of the last refusal; NONE where the server has no such registers or they tell of
    another request. Who asks for a unit that is not served can read none of them: that is the reason."""
    try:
        address, reason, value = client.read_values([client.register_map.find(name) for name in _LAST_REFUSAL])
        kind = RefusalReason(int(reason.value))
    except RefusedError as refused:
        is_unit = refused.code == TARGET_SILENT
        return (RefusalReason.UNIT, NO_ADDRESS, "asked by --unit") if is_unit else (RefusalReason.NONE, 0, "")
    except (CliError, LookupError, ValueError):
        return RefusalReason.NONE, 0, ""
    at = int(address.value)
    if not any(frame.address <= at < frame.address + len(frame.words) for frame in frames):
        return RefusalReason.NONE, 0, ""
    return kind, at, f"{_place(client, at, value)}, {kind.name.lower().replace('_', ' ')}"


def _place(client: GatewayClient, address: int, value: RegisterReading) -> str:
    """Return `force_setpoint = 65 N (address 1)`; without a value where the gateway has none."""
    for register in client.register_map.registers:
        if register.address <= address < register.address + register.words:
            number = f" = {value.value:.9g} {register.unit}".rstrip() if value.is_available else ""
            return f"{register.name}{number} (address {address})"
    return f"address {address}"
