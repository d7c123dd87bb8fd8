"""What can go wrong while a running rig starts, and how it then goes on or ends: ports, the Modbus server, the run before."""

import asyncio
import errno
import time
from collections.abc import Awaitable, Callable
from typing import Final

from gateway import defaults
from gateway.codes.faults import FaultCode
from gateway.codes.warning_bits import WarningBit
from gateway.devices.messages import ForceSample
from gateway.fieldbus import BindError, ModbusTcpServer
from gateway.ports import PortError, SerialPort
from gateway.processes import exit_codes
from gateway.processes.exit_cause import EndCause, Ending
from gateway.profiles import CellLine, OutputLine, Rig
from gateway.service.running_rig.lines.baud_probe import explain_silent_device
from gateway.service.running_rig.lines.output_line import OutputExchange
from gateway.service.running_rig.lines.valve_line import ValveExchange

_HELD_BOUND_S: Final = 0.5
"""How long a restart waits for a port that somebody holds who is about to end, and any start for a permission: udev gives it a
moment after the name, and behind an exit for the want of it nobody starts the service again."""
_RETRY_S: Final = 0.05  # between two attempts within that time
_FIRST_WORDS_S: Final = 3.0  # how long READY waits for both devices' first words before it says that one is silent
_WORDS_AGAIN_S: Final = 0.5  # the same after a restart: what is silent now was not a moment ago, and masters wait


class StartError(Exception):
    """The gateway cannot start; the sentence says why, exit_code how the process ends."""

    def __init__(self, sentence: str, exit_code: int) -> None:
        super().__init__(sentence)
        self.exit_code = exit_code


_FAULTS: Final = {
    EndCause.MACHINE_BUSY: FaultCode.MACHINE_BUSY,
    EndCause.STALLED: FaultCode.LOOP_STALLED,
    EndCause.STOPPED: FaultCode.LOOP_STALLED,
}


def cause_of_restart(restarted: Ending | None, *, was_unclean: bool) -> FaultCode:
    """Return what the fault_code register says after an unclean end: the guardian's cause, or a run that never ended."""
    if restarted:
        return _FAULTS.get(restarted.cause, FaultCode.INTERNAL)
    return FaultCode.INTERNAL if was_unclean else FaultCode.NONE


def lasting_warnings(rig: Rig, *, is_coarse_clock: bool) -> WarningBit:
    """Return the warnings that a run begins and ends with: what this rig and this machine do not have."""
    coarse = WarningBit.CLOCK_FALLBACK if is_coarse_clock else WarningBit(0)
    return coarse | (WarningBit.NO_WATCHDOG if rig.lacks_device_watchdog else WarningBit(0))


def warning_notes(rig: Rig) -> tuple[str, ...]:
    """Return what a start says of them, once: a restart does not repeat it."""
    if not rig.lacks_device_watchdog:
        return ()
    held = f"{rig.output.device.name} has no watchdog: it holds its last voltage when this machine loses power"
    return (f"A343 {held}; the rig accepts that; an air dump valve on the E-stop circuit helps",)


async def open_first(begin: Callable[[], Awaitable[None]]) -> None:
    """Open a port at a first start. begin: opens it, PortError where it does not open."""
    await _open_waiting(begin, "E101")


async def open_again(port: SerialPort) -> PortError | None:
    """Open a port after a restart; the reason where it did not open, None where it did.

    One that is held or away is a lost one, as it would be without the restart: a fault, and tried again for as long as it
    takes. Ending over it would use up the restarts within seconds (A402). PortError where the permission stays missing.
    """
    try:
        await _open_waiting(port.open, "E101", "E103")
    except PortError as error:
        if error.code == "E101":
            raise
        port.begin_lost(error)
        return error
    return None


async def _open_waiting(begin: Callable[[], Awaitable[None]], *passing: str) -> None:
    """Try again for a moment where the reason is one of those that may pass. PortError."""
    deadline_s = time.monotonic() + _HELD_BOUND_S
    while True:
        try:
            return await begin()
        except PortError as error:
            if error.code not in passing or time.monotonic() >= deadline_s:
                raise
        await asyncio.sleep(_RETRY_S)


def waiting_s(*, is_restart: bool) -> float:
    """Return how long a start waits for both devices' first words, s."""
    return _WORDS_AGAIN_S if is_restart else _FIRST_WORDS_S


async def why_silent(
    port: SerialPort, line: OutputLine | CellLine, blamed: str, safe_v: float, *, is_restart: bool
) -> str:
    """Return why a device says nothing. Its port is closed while the probe listens at other speeds, and opened again.

    Not after a restart: seconds of listening would tell what the start has told already. Nor where blamed says that the
    machine did not let us, or a simulated rig, run.
    """
    if is_restart or blamed:
        start, waited_s = "restart" if is_restart else "start", waiting_s(is_restart=is_restart)
        return f"E111 {port.path}: nothing heard within {waited_s:g} s of the {start}; {blamed or 'power, wires?'}"
    port.close()
    sentence = await explain_silent_device(line, port.path, safe_v)
    await port.open()
    return sentence


def have_spoken(output: OutputExchange, sample: ForceSample | None, valve: ValveExchange | None) -> bool:
    """Decide whether every device has said its first words."""
    return output.acknowledged_v is not None and sample is not None and not (valve and valve.status.stands is None)


def silent_valve_notes(valve: ValveExchange | None, port: SerialPort | None, *, is_restart: bool) -> tuple[str, ...]:
    """Return what a start says of a valve that nobody knows the place of; nothing of one that has told it, or that is none."""
    if valve is None or port is None or (status := valve.status).lost or status.stands is not None:
        return ()
    start = f"within {waiting_s(is_restart=is_restart):g} s of the {'restart' if is_restart else 'start'}"
    why = (
        f"it says {status.said}; address, channel or profile of the relay?"
        if status.said
        else "power, wires or address?"
    )
    return (
        f"E111 {port.path}: the valve's relay has not said where it stands {start}: {why} Until then enable is refused",
    )


async def listen(server: ModbusTcpServer, host: str, port: int, instead: str = "") -> tuple[str, int]:
    """Start the Modbus server; return the address and port really bound. StartError says why it does not listen. instead:
    how another port is chosen; empty: --bind."""
    try:
        return await server.start(str(host), int(port))
    except PermissionError as error:
        raise StartError(
            f"E120 port {port} needs the capability net_bind_service; use {instead or f'--bind {host}:{defaults.MODBUS_PORT}'} "
            "(force-gateway explain E120)",
            exit_codes.PERMISSION,
        ) from error
    except BindError as error:
        raise StartError(str(error), exit_codes.CONFIGURATION) from error
    except OSError as error:
        cure = f"another {instead or '--bind HOST:PORT'}?"
        if error.errno == errno.EADDRNOTAVAIL:
            cure = f"{host} is no address of this machine, `ip address` lists them"
        elif error.errno == errno.EADDRINUSE:
            cure = f"another program listens there, `ss -ltnp` shows which; {cure}"
        elif error.errno in (errno.EMFILE, errno.ENFILE):
            cure = "allow more of them: `ulimit -n`, LimitNOFILE= of a service"
        sentence = f"E121 cannot listen on {host}:{port}: {error.strerror or error}; {cure}"
        raise StartError(sentence, exit_codes.DEVICE) from error
