"""The simulated rig: a process of its own with a pty for each line, the device role of each codec, and the twin behind them.

It is a child of the guardian in its own session, so it outlives a kill of control as a real rig does, and ends when the
guardian does (its link closes). The wires take the time that their baud rates take. A socket in the state directory
(`rig.sock`) takes what `force-gateway sim` sets, and faults for tests. What is set is kept in the state directory for as long
as this gateway runs: a rig process that died is started again as it was set.
"""

import asyncio
import contextlib
import json
import os
import signal
import socket
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from gateway.devices import DeviceProfile
from gateway.plain_file import tell_place_and_refusal, tell_refusal
from gateway.ports import PacedPty
from gateway.processes import exit_codes
from gateway.processes import message_link as guardian_link
from gateway.processes.clock_tick import ClockTick
from gateway.processes.event_file import EventFile
from gateway.processes.event_log import EventLog
from gateway.processes.json_socket.server import JsonLineServer
from gateway.processes.scheduling import priority
from gateway.processes.state_directory import RIG_SOCKET
from gateway.profiles import ProfileError, Rig
from gateway.profiles.kept_rig import kept_rig
from gateway.service.simulation.kept_settings import KeptSettings
from gateway.service.simulation.settings import SimulationSettings
from gateway.service.simulation.world import SimulatedRig
from gateway.service.supervisor.fork_server import run_main

_KEPT_S: Final = 1.0  # of a stream that nobody reads, in a driver
_LAST_WORDS_S: Final = 0.5  # longer than control takes to its last write and the answer
_UNPLUGS: Final = {"output": "output.unplug", "load_cell": "cell.unplug", "valve": "valve.unplug"}


class NoPseudoTerminalError(Exception):
    """The kernel has none for a line, and says why."""


class SimulatedLines:
    """The ptys of one simulated rig, by line: output, load_cell and, where the rig has one, valve."""

    def __init__(self, rig: Rig) -> None:
        self.world = SimulatedRig(
            rig,
            send_output=lambda data: self._ptys["output"].send(data),
            send_cell=lambda data: self._ptys["load_cell"].send(data, self._frame_s),
            now_s=time.monotonic(),
        )
        self._ptys = {
            "output": _make_pty(rig.output.device, self.world.on_output_bytes),
            "load_cell": _make_pty(rig.load_cell.device, self.world.on_cell_bytes),
        }
        if rig.valve:
            self._ptys["valve"] = _make_pty(rig.valve.device, self._on_valve_bytes)
        self._paths: dict[str, str] = {}
        self._frame_s: float | None = None  # when the amplifier sends, where that is not now
        self._rate_hz = rig.load_cell.device.rate_hz
        self._tick = ClockTick(1.0 / self._rate_hz, self._on_tick) if self._rate_hz else None

    def open(self) -> None:
        """Open all ports, and begin to stream; NoPseudoTerminalError where there is none for one of them."""
        try:
            for pty in self._ptys.values():
                pty.open()
        except OSError as error:
            raise NoPseudoTerminalError(tell_refusal(error)) from error
        if self._tick:
            self._tick.start()

    def close(self) -> None:
        """Close all ports."""
        if self._tick:
            self._tick.close()
        for pty in self._ptys.values():
            pty.close()

    def paths(self) -> dict[str, str]:
        """Return where the ports are; of an unplugged one, where it was last."""
        self._paths |= {name: pty.path for name, pty in self._ptys.items() if pty.is_open}
        return dict(self._paths)

    def plug(self, settings: SimulationSettings) -> bool:
        """Pull and put back plugs as the settings say; return whether there are other ports now."""
        has_moved = False
        for name, pty in self._ptys.items():
            is_wanted = not settings.is_on(_UNPLUGS[name])
            if pty.is_open and not is_wanted:
                pty.close()
            elif is_wanted and not pty.is_open:
                pty.open()
                has_moved = True
        return has_moved

    def _on_valve_bytes(self, chunk: bytes, now_s: float) -> None:
        self._ptys["valve"].send(self.world.on_valve_bytes(chunk, now_s))

    def _on_tick(self, expirations: int, late_s: float) -> None:
        """A stream, whose amplifier leaves out what its wire has no time for. It has not waited for a process that comes late:
        its frames are on the wire at their times, as many as a driver keeps."""
        pty, now_s = self._ptys["load_cell"], time.monotonic()
        for behind in reversed(range(min(expirations, round(self._rate_hz * _KEPT_S)))):
            self._frame_s = now_s - late_s - behind / self._rate_hz
            if pty.is_open and pty.backlog_at(self._frame_s) * self._rate_hz < 1.0:
                self.world.stream(self._frame_s)
        self._frame_s = None


def _make_pty(device: DeviceProfile, on_bytes: Callable[[bytes, float], None]) -> PacedPty:
    serial = device.serial
    return PacedPty(serial.baud, on_bytes=on_bytes, bits_per_character=serial.bits_per_character)


class SimulationSocket:
    """What rig.sock answers: sim and fault. tell_ports: to the guardian, whenever they have moved."""

    def __init__(
        self, lines: SimulatedLines, kept: KeptSettings, tell_ports: Callable[[], None], log: EventLog
    ) -> None:
        self._lines, self._kept, self._tell_ports, self._log = lines, kept, tell_ports, log

    def restore(self) -> None:
        """Set what was set before this process was started again."""
        settings = self._kept.read()
        if settings.values:
            self._lines.world.use_settings(settings)
            self._log("simulation", f"the simulated rig is set as it was before: {_in_words(settings)}")

    def simulate(self, request: dict[str, Any]) -> dict[str, Any]:
        """Answer the verb sim, see `SimulatedRig.simulate`."""
        world = self._lines.world
        before, answer = world.settings, world.simulate(request)
        if world.settings != before:
            self._log("simulation", f"the simulated rig is set: {_in_words(world.settings)}")
            self._follow()
        return answer

    def fault(self, request: dict[str, Any]) -> dict[str, Any]:
        """Answer the verb fault, see `SimulatedRig.fault`."""
        answer = self._lines.world.fault(request)
        self._follow()
        return answer

    def _follow(self) -> None:
        settings = self._lines.world.settings
        if self._lines.plug(settings):
            self._tell_ports()
        try:
            self._kept.write(settings)
        except OSError as error:
            self._log(
                "simulation",
                f"what is set does not outlive the simulated rig's process: {tell_place_and_refusal(error)}",
            )


def _in_words(settings: SimulationSettings) -> str:
    told = (f"{name}={'on' if value is True else f'{value:g}'}" for name, value in settings.values.items())
    return ", ".join(told) or "nothing, it is as its files say"


async def serve(rig: Rig, link: socket.socket, kept: KeptSettings, log: EventLog, ended: asyncio.Event) -> None:
    """Run until the guardian's end of the link closes, or something else has set `ended`; either leaves no socket behind.

    Of a guardian that was killed, control is still to hear: a real rig stays and takes its last words, and so does this one."""
    loop = asyncio.get_running_loop()
    lines = SimulatedLines(rig)

    def tell_ports() -> None:
        with contextlib.suppress(OSError):  # it has gone: so do we
            guardian_link.send(link, guardian_link.PTYS, {"ptys": lines.paths(), "pid": os.getpid()})

    answers = SimulationSocket(lines, kept, tell_ports, log)
    server = JsonLineServer(kept.state / RIG_SOCKET, {"fault": answers.fault, "sim": answers.simulate}, log)
    lines.open()
    answers.restore()
    if unserved := await server.start():
        log("socket", f"E152 {unserved}")
    loop.add_reader(link.fileno(), ended.set)
    tell_ports()
    lines.plug(lines.world.settings)
    await ended.wait()
    loop.remove_reader(link.fileno())
    await server.close()
    if _is_orphan(link):
        await asyncio.sleep(_LAST_WORDS_S)
    lines.close()


def _is_orphan(link: socket.socket) -> bool:
    """Decide whether the guardian has gone without asking for our end."""
    with contextlib.suppress(BlockingIOError, guardian_link.ProtocolError):
        return guardian_link.receive(link) is None
    return False


async def _serve_process(rig: Rig, link: socket.socket, kept: KeptSettings, log: EventLog) -> None:
    """The same as a process of its own. Who stops the gateway may tell every process so (systemd, `pkill`): the force is ramped
    down on us then, and the guardian ends us behind that, by a signal, too: a loop that heard it would be half closed."""
    signal.signal(signal.SIGTERM, lambda *_: None)
    await serve(rig, link, kept, log, asyncio.Event())


def main(arguments: list[str]) -> int:
    """Run the simulated rig; return its exit code. arguments: descriptor of the link, options as JSON."""
    options = json.loads(arguments[1])
    state = Path(options["state"])
    priority.set_nice(priority.RIG_NICE)
    with socket.socket(fileno=int(arguments[0])) as link, EventLog(source="rig", file=EventFile(state)) as log:
        kept = KeptSettings(state, options.get("run", ""))
        try:
            rig = kept_rig(options["rig"], simulated=options["simulate"], memory=options.get("kept_rig"))
        except ProfileError as error:  # edited since
            log("rig", "E151 the rig file has faults:\n" + "\n".join(map(str, error.faults)))
            return exit_codes.CONFIGURATION
        try:
            asyncio.run(_serve_process(rig, link, kept, log))
        except NoPseudoTerminalError as error:
            log(
                "rig",
                f"E106 no pseudo-terminal for the simulated lines: {error} (ls -l /dev/ptmx; mount | grep devpts)",
            )
            return exit_codes.DEVICE
    return 0


if __name__ == "__main__":
    run_main(main)
