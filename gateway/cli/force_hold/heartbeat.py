"""The thread that keeps the heartbeat: it alone speaks to the gateway, so a terminal that takes no more lines, or one that is
slow to draw, never costs the lease, nor keeps the force beyond its time.
"""

import re
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from math import inf
from typing import Final

from gateway import defaults
from gateway.cli.errors import CliError
from gateway.cli.force_hold.sequence import STATUS_NAMES, HoldEnd, HoldRun, HoldWrite, StatusReading, status_reading_of
from gateway.cli.force_hold.signal_flag import SignalFlag
from gateway.cli.master.byte_order_proof import write_with_proof
from gateway.cli.master.client import Assignment, GatewayClient
from gateway.cli.master.refusal_text import explain_refusals
from gateway.codes.warning_bits import WarningBit
from gateway.processes import exit_codes
from gateway.registers.words import State

_ACTIONS: Final = {
    "fault": "safe voltage, fault A310",
    "hold": "the force stays, with a warning",
    "ramp": "it ramps to 0 N",
}
DEFAULT_PERIOD_S: Final = defaults.LEASE_S / defaults.BEATS_PER_LEASE  # where the rig's lease is unknown
_SHORTEST_PERIOD_S: Final = 0.005
_LOOK_S: Final = 0.1
_OBEYED_S: Final = 0.3  # three times the usual bound on an output's silence
_LOOKS_AFTER_A_LOSS_S: Final = 2.0  # without a lease, or one that we do not know


@dataclass(frozen=True, slots=True)
class KnownLease:
    """What is known of the rig's lease. length_s None: it has none."""

    length_s: float | None
    action: str = "fault"

    @property
    def period_s(self) -> float:
        """Between two beats: several may be late before one is missed."""
        shared = DEFAULT_PERIOD_S if self.length_s is None else self.length_s / defaults.BEATS_PER_LEASE
        return min(DEFAULT_PERIOD_S, max(_SHORTEST_PERIOD_S, shared))


class HeartbeatThread(threading.Thread):
    """Runs a HoldRun against a gateway until it ends. `status` is the newest one read; `failure` what went wrong, if anything.

    lease: None where nobody has said what the rig's is. lasts_s: how long behind its enable it lets go by itself.
    """

    def __init__(
        self, client: GatewayClient, run: HoldRun, lease: KnownLease | None, clock: Callable[[], float]
    ) -> None:
        super().__init__(daemon=True, name="heartbeat")
        self.hold = run
        self.status: StatusReading | None = None
        self.warned = WarningBit(0)  # every warning that there was
        self.failure: Exception | None = None
        self.stopping = SignalFlag()
        self.dropping = SignalFlag()
        self.lasts_s = inf
        self._pause = threading.Event()  # nobody ends it
        self._client = client
        self._lease = lease
        self._period_s = lease.period_s if lease else DEFAULT_PERIOD_S
        self._clock = clock
        self._looked_s = 0.0
        find = client.register_map.find
        self._shown = [find(name) for name in STATUS_NAMES]
        self._names = {
            name: find(name) for name in ("control_word", "force_setpoint", "force_ramp", "mode", "heartbeat")
        }

    def run(self) -> None:
        """Look, then beat until the hold has ended or the gateway is gone."""
        try:
            self._look()
            enabled_s: float | None = None
            while self.hold.end is None:
                began_s = self._clock()
                if enabled_s is not None and began_s - enabled_s >= self.lasts_s:
                    self.stopping.set()
                self._step(began_s)
                if enabled_s is None and self.hold.is_pressing:
                    enabled_s = began_s
                if self.hold.end is None:
                    self._wait(self._period_s - (self._clock() - began_s))
            self._look()
            if self.hold.is_pressing and self.hold.end is HoldEnd.STOPPED:
                self._watch_output()
        except CliError as error:
            self.failure = error
        except Exception as error:  # a defect, or a gateway that says what this version does not know
            self.failure = error
            if self.hold.is_pressing:
                with suppress(Exception):  # the first one is told
                    self._send(self.hold.at_once())

    def _watch_output(self) -> None:
        """An output that does not obey the safe voltage is a fault behind the disable, which nobody else may look at."""
        end_s = self._clock() + _OBEYED_S
        with suppress(CliError):  # a gateway that ends meanwhile has been told to let go
            while self._clock() < end_s:
                self._pause.wait(_SHORTEST_PERIOD_S)
                self._look()
                if self.status and self.status.state is State.FAULT:
                    self.hold.end = HoldEnd.FAULT
                    return

    def _wait(self, seconds: float) -> None:
        """The order to drop everything is not waited for."""
        if not self.dropping.is_set():
            self.dropping.wait(max(0.0, seconds))

    def _step(self, now_s: float) -> None:
        assert self.status
        write = self.hold.at_once() if self.dropping.is_set() else None
        write = write or self.hold.next(self.status, now_s, stops=self.stopping.is_set())
        if write is None:
            return
        try:
            self._send(write)
            if write.control_word is not None or now_s - self._looked_s >= _LOOK_S:
                self._look()
        except CliError as error:
            if error.exit_code != exit_codes.DEVICE:
                raise
            self.hold.note_lost(write)
            self._find_again(error)

    def _send(self, write: HoldWrite) -> None:
        values = {"heartbeat": float(write.heartbeat)}
        if write.control_word is not None:
            values |= {
                "control_word": write.control_word,
                "force_setpoint": write.setpoint_n,
                "force_ramp": 0,
                "mode": 0,
            }
        frames = self._client.frames(
            [Assignment(self._names[name], self._names[name].encode(value)) for name, value in values.items()]
        )
        with explain_refusals(self._client, frames):
            for frame in frames:
                write_with_proof(self._client, frame)

    def _look(self) -> None:
        with explain_refusals(self._client):
            readings = self._client.read_values(self._shown)
        self.status = status_reading_of({reading.register.name: float(reading.value) for reading in readings})
        self.warned |= self.status.warnings
        self._looked_s = self._clock()

    def _find_again(self, error: CliError) -> None:
        """The connection is gone: while the lease may still run, try to have it back; the next step sees what has happened."""
        length_s = self._lease.length_s if self._lease else None
        end_s = self._clock() + (length_s or _LOOKS_AFTER_A_LOSS_S)
        while True:
            try:
                self._look()
                return
            except CliError:
                if self._clock() >= end_s:
                    raise CliError(f"E180 {self._lost_words(error)}", exit_codes.DEVICE) from None
            self._wait(_SHORTEST_PERIOD_S)

    def _lost_words(self, error: CliError) -> str:
        where = self._client.where
        code, _, told = error.format_message().partition(" ")
        behind = told.partition(where)[2].lstrip(": ") or told  # the place is said already, and has a colon in it
        seen = re.split("[:;]", behind)[0]
        what = f"the gateway at {where} is lost ({code} {seen})"
        if not self.hold.is_pressing:
            return f"{what}; nothing had been enabled"
        if self._lease is None:
            return (
                f"{what}. Where the rig has a lease, it ends now as the rig file says (fault, hold or ramp); without one the "
                f"gateway goes on pressing {self.hold.force_n:g} N: look at it"
            )
        if self._lease.length_s is None:
            words = "this rig has no lease: if the gateway lives, it goes on pressing"
            return f"{what}; {words} {self.hold.force_n:g} N until it is told otherwise"
        action = _ACTIONS.get(self._lease.action, self._lease.action)
        return f"{what}; the lease of {self._lease.length_s * 1e3:.0f} ms is over: {action}"
