"""A calibration of a gateway elsewhere, by Modbus: bit 5 starts the gateway's own plan, clearing it ends the run.

A rig with a lease wants a heartbeat from the master that started the run, so one is kept from the start to the end, by a
thread: a terminal that is slow to draw costs no lease. Both use one connection, one at a time: a serial line has only one.
"""

import threading
from collections.abc import Callable
from math import nan
from typing import Any, Final, TypeVar

from gateway import defaults
from gateway.cli.calibration.runs import ENDED, RunStatus
from gateway.cli.errors import CliError
from gateway.cli.force_hold.heartbeat import DEFAULT_PERIOD_S
from gateway.cli.master.byte_order_proof import write_with_proof
from gateway.cli.master.client import Assignment, GatewayClient, RefusedError
from gateway.cli.master.first_heartbeat import draw_first_heartbeat
from gateway.cli.master.refusal_text import explain_refusals
from gateway.cli.master.wires import Wire
from gateway.codes.faults import FaultCode
from gateway.processes import exit_codes
from gateway.profiles import load_register_map
from gateway.registers.words import CalibrationPhase, ControlBit

_WORDS: Final = (
    "calibration_phase", "calibration_progress", "calibration_stored", "force_measured", "output_voltage", "fault_code",
)  # fmt: skip

_TRIES: Final = 3
_RUNNING: Final = ("zero", "check", "ladder", "minor_loops", "experiment", "self_test")
Said = TypeVar("Said")


class RemoteRun:
    """A gateway elsewhere; the recording and the report are there, too."""

    lost_words = (
        "where the gateway lives and its rig has no lease the run goes on, with nobody there: look at it, and end it by "
        "control_word 0"
    )

    def __init__(self, wire: Wire, unit: int, map_name: str = defaults.REGISTER_MAP) -> None:
        self._map = load_register_map(map_name)
        self._client = GatewayClient(wire, unit, self._map)
        self._registers = [self._map.find(name) for name in _WORDS]
        self._values: list[float] = []
        self._before = ""
        self._number = draw_first_heartbeat(0)
        self._turn = threading.Lock()
        self._ended = threading.Event()
        self._beat = threading.Thread(target=self._keep_lease, daemon=True, name="heartbeat")

    def preview(self) -> dict[str, Any]:
        """Return nothing: by Modbus nobody says beforehand what will happen."""
        return {}

    def begin(self) -> None:
        """Start the run by the control word, and keep its lease from now on. Where one runs already the bit would not rise: it
        would be followed, and ended by our Ctrl-C."""
        self._said_again(self._check_map)
        self._before = (there := self.look()).phase
        if self._before in _RUNNING:
            share = f"{self._before.replace('_', ' ')}, {there.progress:.0%}"
            raise CliError(
                f"W310 a run has the output there already ({share}): wait for its end; control_word 0 ends it"
            )
        try:
            self._command(int(ControlBit.START_CALIBRATION), heartbeat=self._number)
        except CliError as error:
            if error.exit_code != exit_codes.DEVICE or not self._has_begun(error):
                raise
        self._beat.start()

    def _has_begun(self, lost: CliError) -> bool:
        """Decide whether the run goes although the answer to its start was lost: then it needs somebody who follows it.
        CliError where nobody tells."""
        try:
            return self.look().phase not in ("idle", *ENDED)
        except CliError:
            sentence = f"{lost.format_message()}\nthe start was sent, and may have been heard; {self.lost_words}"
            raise CliError(sentence, lost.exit_code) from None

    def look(self) -> RunStatus:
        """Read from the registers how far the run is; asked again where an answer is lost, as noise on a line does."""
        self._values = self._said_again(self._read)
        phase, progress, _, force_n, output_mv, _ = self._values
        name = CalibrationPhase(int(phase)).name.lower()
        if name == self._before and name in ENDED:
            name = "idle"  # what the run before left
        elif name != self._before:
            self._before = ""
        return RunStatus(name, progress / 1000.0, nan, force_n, output_mv / 1000.0)

    def stop(self) -> None:
        """Stop the run; the force goes to 0. Said again where nobody has answered: it may not have been heard."""
        self._said_again(lambda: self._command(0))

    def _check_map(self) -> None:
        with self._turn, explain_refusals(self._client):
            self._client.check_map()

    def _read(self) -> list[float]:
        with self._turn, explain_refusals(self._client):
            return [reading.value for reading in self._client.read_values(self._registers)]

    def _said_again(self, say: Callable[[], Said]) -> Said:
        for _ in range(_TRIES - 1):
            try:
                return say()
            except CliError as error:
                if error.exit_code != exit_codes.DEVICE:
                    raise
        return say()

    def end(self) -> dict[str, Any]:
        """Return how it ended: phase and number of the stored calibration; sentence: the fault that has ended it."""
        phase = CalibrationPhase(int(self._values[0])).name.lower()
        ended = {"phase": phase, "stored": int(self._values[2])}
        fault = FaultCode(int(self._values[5])).explanation
        if not fault.code:
            return ended
        cure = f"{fault.do} (force-gateway explain {fault.code})"
        return ended | {"sentence": f"{fault.code} {fault.title}: {fault.seen} The calibration has stopped\n  {cure}"}

    def close(self) -> None:
        """End the heartbeat and the connection."""
        self._ended.set()
        if self._beat.is_alive():
            self._beat.join()
        self._client.close()

    def _command(self, word: int, **beside: int) -> None:
        """Write the control word, and other registers in one request with it."""
        named = [(self._map.find(name), value) for name, value in ({"control_word": word} | beside).items()]
        with self._turn:
            for frame in self._client.frames(
                [Assignment(register, register.encode(value)) for register, value in named]
            ):
                with explain_refusals(self._client, [frame]):
                    write_with_proof(self._client, frame)

    def _keep_lease(self) -> None:
        """Change the heartbeat until the end, or until another master commands. Whoever looks tells of a lost connection."""
        register = self._map.find("heartbeat")
        while not self._ended.wait(DEFAULT_PERIOD_S):
            self._number = (self._number + 1) % 0x10000
            try:
                with self._turn:
                    self._client.write_values([Assignment(register, register.encode(self._number))])
            except RefusedError:
                return
            except CliError:
                continue
