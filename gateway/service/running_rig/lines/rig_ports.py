"""The serial ports of a running rig: output, load cell and, where it has one, valve, opened, lost, found again and closed.

Their bytes go to the control loop; the output's descriptor goes to the guardian, which writes the last safe voltage to it.
"""

import asyncio
import contextlib
from collections.abc import Callable

from gateway.control.supervision.safe_voltage import NEAR_V
from gateway.ports import PortError, PortEvents, SerialPort
from gateway.profiles import Rig
from gateway.service.running_rig.control_loop import ControlLoop, Log
from gateway.service.running_rig.starting import open_again, open_first


class RigPorts:
    """paths: by line, `output`, `load_cell`, `valve`. hand_over: called with the descriptor of each opened output;
    OSError where the guardian cannot be given it. take_back: called when that port is lost.

    loop: to be set before `open`.
    """

    loop: ControlLoop

    def __init__(
        self,
        rig: Rig,
        paths: dict[str, str],
        hand_over: Callable[[int], None],
        log: Log,
        take_back: Callable[[], None] = lambda: None,
    ) -> None:
        self._hand_over, self._take_back, self._log = hand_over, take_back, log
        self._is_closing = False
        self.is_guarded = False  # the guardian has the output's descriptor
        self._unguarded = ""  # why it has not, once that is told
        self.not_opened: dict[str, PortError] = {}  # after a restart, by path
        self.output = SerialPort(
            paths["output"],
            rig.output.settings,
            PortEvents(
                self._on_output_bytes, self._on_output_lost, self._on_output_open, self._on_refused, self._on_restored
            ),
            is_simulated=rig.simulated,
        )
        self.cell = SerialPort(
            paths["load_cell"],
            rig.load_cell.settings,
            PortEvents(
                self._on_cell_bytes, self._on_cell_lost, self._on_cell_open, self._on_refused, self._on_restored
            ),
            is_simulated=rig.simulated,
        )

        self.valve: SerialPort | None = None
        if rig.valve:
            self.valve = SerialPort(
                paths["valve"],
                rig.valve.settings,
                PortEvents(
                    self._on_valve_bytes, self._on_valve_lost, self._on_valve_open, self._on_refused, self._on_restored
                ),
                is_simulated=rig.simulated,
            )

    @property
    def _all(self) -> tuple[SerialPort, ...]:
        return (self.output, self.cell, *((self.valve,) if self.valve else ()))

    async def open(self, *, is_restart: bool) -> None:
        """Open the ports. PortError where one cannot be opened; after a restart such a port is a lost one."""
        for port in self._all:
            if not is_restart:
                await open_first(port.open)
            elif error := await open_again(port):
                self.not_opened[port.path] = error

    @property
    def paths(self) -> dict[str, str]:
        """Return where the lines are now, by name."""
        ports = {"output": self.output, "load_cell": self.cell, "valve": self.valve}
        return {name: port.path for name, port in ports.items() if port}

    def move(self, paths: dict[str, str]) -> None:
        """Move to where the devices are now: what was lost is opened there."""
        self.output.move(paths["output"])
        self.cell.move(paths["load_cell"])
        if self.valve:
            self.valve.move(paths["valve"])

    async def write_last(self, frame: bytes) -> None:
        """Write the frame, as far as the output takes it, and of the loop nothing after it."""
        self._is_closing = True
        with contextlib.suppress(PortError):
            await self.output.write_last(frame)

    async def let_go_output(self, last_frame: bytes, reply_s: float, rest_v: float) -> None:
        """Write what disarms the output's watchdog, where it has one, once the safe voltage has been answered: on a bus of two
        wires both would talk at once. Not where even then the safe voltage rest_v does not surely stand: were its frame lost,
        nobody else would take away what presses. reply_s: longest time of an answer."""
        if not last_frame:
            return
        await asyncio.sleep(reply_s)
        stands_v = self.loop.output.standing_v
        if stands_v is not None and abs(stands_v - rest_v) <= NEAR_V:
            await self.write_last(last_frame)

    def close(self) -> None:
        """Close all ports."""
        for port in self._all:
            port.close()

    def write_output(self, data: bytes) -> None:
        """Write a request to the output device."""
        if not self._is_closing:
            self.output.flush_input()  # at most one question is out: whatever is there answers none of ours
            self.output.write(data)

    def drop_output(self) -> None:
        """Drop what the output's line has not sent of questions that nobody waits for any more."""
        if not self._is_closing:
            self.output.drop_unsent()

    def write_cell(self, data: bytes) -> None:
        """Write a question to a load cell that speaks only when asked."""
        if not self._is_closing:
            self.cell.flush_input()
            self.cell.write(data)

    def write_valve(self, data: bytes) -> None:
        """Write a question to the valve's relay."""
        if self.valve and not self._is_closing:
            self.valve.flush_input()
            self.valve.write(data)

    def _on_output_bytes(self, chunk: bytes, now_s: float) -> None:
        self.loop.on_output_bytes(chunk, now_s)

    def _on_output_open(self, descriptor: int) -> None:
        self._have_guarded(descriptor)
        self.loop.on_output_opened()
        self._warn_of_latency(self.output)

    def _have_guarded(self, descriptor: int) -> None:
        try:
            self._hand_over(descriptor)
        except OSError as error:
            refusal = _explain_unguarded(self.output.path, error)
            if str(refusal) != self._unguarded:
                self._log("port", str(refusal))
            self._unguarded = str(refusal)
            raise refusal from error
        self.is_guarded, self._unguarded = True, ""

    def _on_output_lost(self, error: PortError) -> None:
        self._log("port", str(error))
        if self.is_guarded:
            self._take_back()
        self.is_guarded = False
        self.loop.on_output_closed()

    def _on_refused(self, error: PortError) -> None:
        self._log("port", f"{error}; tried again until it opens")

    def _on_restored(self, change: PortError) -> None:
        self._log("port", str(change))

    def _on_cell_bytes(self, chunk: bytes, now_s: float) -> None:
        self.loop.on_cell_bytes(chunk, now_s)

    def _on_cell_open(self, descriptor: int) -> None:
        self.loop.on_cell_opened()
        self._warn_of_latency(self.cell)

    def _on_cell_lost(self, error: PortError) -> None:
        self._log("port", str(error))
        self.loop.cell_lost = True

    def _on_valve_bytes(self, chunk: bytes, now_s: float) -> None:
        self.loop.on_valve_bytes(chunk, now_s)

    def _on_valve_open(self, descriptor: int) -> None:
        self.loop.on_valve_opened()
        assert self.valve
        self._warn_of_latency(self.valve)

    def _on_valve_lost(self, error: PortError) -> None:
        self._log("port", str(error))
        self.loop.on_valve_closed()

    def _warn_of_latency(self, port: SerialPort) -> None:
        if port.warning:
            self._log("port", port.warning)


def _explain_unguarded(path: str, error: OSError) -> PortError:
    reason = f"the guardian, which writes the last safe voltage, cannot be given this port ({error})"
    return PortError("E102", f"{path} is closed again, and tried again: {reason}")
