"""The rules of the control word, said once more: shares nothing with the gateway but the names of bits, states and reasons."""

from dataclasses import dataclass
from typing import Final

from gateway.codes.refusals import RefusalReason as Reason
from gateway.registers.words import State
from tests.service.edge_table.places import Place

ENABLE, RESET, TARE, TAKE, VALVE, CALIBRATE, SELF_TEST = (1 << k for k in range(7))
ACTS_EACH_TIME: Final = RESET | TARE | TAKE
RUNS: Final = CALIBRATE | SELF_TEST
ENABLED: Final = (State.READY, State.RAMPING, State.HOLDING, State.CALIBRATING)


@dataclass(frozen=True)
class Asked:
    """What a write asks for. force_n: its setpoint, None where it has none; word: None where it has none; beats: it brings a
    new heartbeat; changes: it changes another register (tilt, ramp, mode ...)."""

    word: int | None = None
    force_n: float | None = None
    beats: bool = False
    changes: bool = False


class Verdict:
    """Of one write in one place: its reason (NONE: taken), and what then is: the force, and whether the output is enabled."""

    def __init__(self, place: Place, leased: bool, asked: Asked) -> None:
        self._place, self._asked = place, asked
        self._word = place.stands if asked.word is None else asked.word
        self._rises, self._falls = self._word & ~place.stands, place.stands & ~self._word
        self._is_stale = leased and not asked.beats
        self.stops = bool(self._falls & ENABLE and not self._rises & RUNS) or self._ends_a_run_without_bits()
        given_n = place.force_n if asked.force_n is None else asked.force_n
        self.force_n = 0.0 if self.stops else given_n
        self.reason = self._reason()
        self.begins_run = bool(self._rises & RUNS)
        self.ends_run = bool(self._falls & RUNS) and place.runs and not self.stops
        self.is_enabled = not self.stops and (place.state in ENABLED or bool(self._rises & (ENABLE | RUNS)))
        self.resets = bool(self._rises & RESET)
        self.changes_another = asked.changes
        self.word = 0 if self.stops else self._word & ~ACTS_EACH_TIME

    @property
    def effect(self) -> tuple[object, ...]:
        """What the next seconds depend on."""
        edges = self.stops, self.begins_run, self.ends_run, self.resets, self._rises & TARE, self.changes_another
        return (*edges, self.changes_nothing, self.is_enabled, self.force_n)

    @property
    def changes_nothing(self) -> bool:
        """Taken, and force and state go on as they would have."""
        acts = self._rises & ~TAKE or self._falls or self.stops
        return not acts and self.force_n == self._place.force_n and not self._asked.changes

    def _ends_a_run_without_bits(self) -> bool:
        """A run of this machine has no bit that could fall: 0 in the control word and nothing else ends it."""
        is_bare = self._asked.word == 0 and self._asked.force_n is None and not self._asked.beats
        return self._place.runs and not self._place.stands and is_bare

    def _reason(self) -> Reason:
        place = self._place
        if self._word & VALVE:
            return Reason.UNSUPPORTED_BIT  # this rig has none
        if not self.stops and (place.runs or place.is_going):
            moves = self._asked.changes or self.force_n != place.force_n
            if self._rises & ~TAKE or moves:
                return Reason.CALIBRATING if place.runs else Reason.STOPPING
        if place.is_given_up and self._is_stale and not self.stops and self.force_n > place.force_n > 0.0:
            return Reason.HEARTBEAT_STALE
        reasons = (self._of_reset(), self._of_tare(), self._of_enable(), *self._of_runs())
        return next((one for one in reasons if one), Reason.NONE)

    @property
    def _state(self) -> State:
        """That the edges after a stop and a reset find."""
        return State.OFF if (self.stops and self._place.state in ENABLED) or self._rises & RESET else self._place.state

    def _of_reset(self) -> Reason:
        if not self._rises & RESET:
            return Reason.NONE
        if self._place.state in ENABLED:
            return Reason.NOTHING_TO_RESET
        if self._word & (ENABLE | RUNS) or self.force_n:
            return Reason.RESET_NEEDS_ZERO
        return Reason.HEARTBEAT_STALE if self._place.state is State.FAULT and self._is_stale else Reason.NONE

    def _of_tare(self) -> Reason:
        if not self._rises & TARE:
            return Reason.NONE
        return Reason.TARE_REFUSED if self._state is State.FAULT or self._place.presses else Reason.NONE

    def _of_enable(self) -> Reason:
        if not self._rises & ENABLE or self._state in ENABLED:
            return Reason.NONE
        if self._state is State.FAULT:
            return Reason.FAULT_LATCHED
        return self._of_beat() or (Reason.NOT_READY if self._place.is_stopped else Reason.NONE)

    def _of_beat(self) -> Reason:
        return Reason.HEARTBEAT_STALE if self._place.is_given_up and self._is_stale else Reason.NONE

    def _of_runs(self) -> list[Reason]:
        found = []
        for bit, reason in ((CALIBRATE, Reason.CALIBRATION_REFUSED), (SELF_TEST, Reason.SELF_TEST_REFUSED)):
            if self._rises & bit:
                found += [self._of_run(reason), self._of_beat(), reason if self.force_n else Reason.NONE]
        both = self._rises & RUNS == RUNS
        return [*found, Reason.SELF_TEST_REFUSED if both else Reason.NONE]

    def _of_run(self, reason: Reason) -> Reason:
        if self._place.is_fitting:
            return Reason.FITTING
        if self._state not in (State.OFF, State.READY) or (self._place.presses and not self.stops):
            return reason
        return Reason.NOT_READY if self._place.is_stopped else Reason.NONE
