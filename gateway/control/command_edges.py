"""The command block from write to write: which bits rose and fell, what is demanded, whether the heartbeat moved."""

from collections.abc import Callable
from dataclasses import replace
from math import copysign, inf
from typing import Final, NamedTuple

from gateway.bsfm import Bsfm
from gateway.control.demand import Demand, Manner, demand_of, is_same_manner, manner_of
from gateway.control.inputs import LineStatus
from gateway.control.limits import NotFiniteError, narrow_limits
from gateway.control.messages import master_lost_sentence
from gateway.control.settings import ControlSettings
from gateway.control.supervision.lease import Lease
from gateway.registers.command import Command
from gateway.registers.words import RUN_BITS, ControlBit
from gateway.units import STANDARD_GRAVITY_M_PER_S2

_ENABLE, _TAKE = int(ControlBit.ENABLE), int(ControlBit.TAKE_OWNERSHIP)
_MOMENTARY: Final = int(ControlBit.RESET_FAULT | ControlBit.TARE | ControlBit.TAKE_OWNERSHIP)


class Edges(NamedTuple):
    """Bits of the control word that rose and that fell; stops: the output is to go off, whatever else."""

    rises: int = 0
    falls: int = 0
    stops: bool = False


NO_EDGES: Final = Edges()


class CommandTracker:
    """`demand` is the last one that made sense; `not_finite` names the number that did not, or is empty. applied_n: force that
    the output goes for at this moment, N."""

    def __init__(self, settings: ControlSettings, applied_n: Callable[[], float] = lambda: 0.0) -> None:
        self.command = Command()
        self._applied_n, self._taken_s = applied_n, 0.0
        self._payload_kg = self._wanted_kg = settings.defaults.payload_kg
        self._manner: Manner | None = None  # of the command, where that is known
        self.demand: Demand = demand_of(self.command, settings)
        self.not_finite = ""
        self._word = 0
        self._lease = Lease(settings.supervision.lease_s)
        self.beats_of, self.hear_refused = self._lease.beats_of, self._lease.hear_refused
        self._settings = self._rig_settings = settings
        self._direction = 1.0

    def turn(self, direction: float) -> None:
        """Count forces along the tool's axis the other way (-1: it pulls): the payload's weight changes its sign."""
        self._direction = direction
        self._update_demand()

    def use(self, model: Bsfm) -> None:
        """Hold to the force limits of this calibration, too: the demand of the last command may become a smaller one."""
        limits = narrow_limits(self._rig_settings.limits, model.limits_n)
        self._settings = replace(self._rig_settings, limits=limits)
        self._update_demand()

    def expect_clearing(self) -> None:
        """Note that the bank is asked to zero the command: no bit stands any more."""
        self._word = 0

    def edges_of(self, command: Command) -> Edges:
        """Return what changes in the control word with this command. Reset, tare and takeover act whenever they are written as
        1."""
        word = int(command.control_word)
        if command.number == self.command.number:
            word &= ~_MOMENTARY  # the bank's own change of a command that has acted
        if word == self._word and not command.stops:
            return NO_EDGES  # most writes are so
        rises, falls = word & ~self._word, self._word & ~word
        return Edges(rises, falls, command.stops or bool(falls & _ENABLE and not rises & RUN_BITS))

    def take(self, now_s: float, command: Command) -> Edges:
        """Take this as the command from now on; none of its edges act twice. Ask at each step: a payload follows in time."""
        dt_s, self._taken_s = now_s - self._taken_s, now_s
        if dt_s > self._settings.supervision.stall_s:
            self._lease.stand_still(now_s)
        if command is self.command:
            if self._payload_kg != self._wanted_kg:
                self._follow_payload(dt_s)
                self._update_demand()
            return NO_EDGES
        edges = self.edges_of(command)
        self._word = 0 if edges.stops else int(command.control_word) & ~_MOMENTARY
        if self._manner is not None and not is_same_manner(command, self.command):
            self._manner = None
        self.command = command
        if command.has_waited or command.repeats:
            self._lease.pass_over(command.heartbeat, command.channel)
        else:
            self._lease.observe(now_s, command.heartbeat, command.peer, command.channel)
        if edges.rises & _TAKE:
            self._lease.take_over(now_s, command.peer)
        if edges.stops or edges.falls & RUN_BITS:
            self._lease.stop(now_s, command.peer)
        self._wanted_kg = command.payload_kg if command.payload_kg > 0.0 else self._settings.defaults.payload_kg
        self._follow_payload(dt_s)
        self._update_demand()
        return edges

    def _follow_payload(self, dt_s: float) -> None:
        """Go on towards the payload of the command, under a force no faster than along the ramp: the slide follows its weight,
        and 1 kg less would press 10 N more in the next moment. A tilt that is told is one that the robot goes through."""
        if self._payload_kg == self._wanted_kg:
            return
        missing_kg = self._wanted_kg - self._payload_kg
        most_kg = self.demand.manner.ramp_n_per_s / STANDARD_GRAVITY_M_PER_S2 * max(0.0, dt_s)
        if self._applied_n() > 0.0 and most_kg < abs(missing_kg) < inf:
            self._payload_kg += copysign(most_kg, missing_kg)
        else:
            self._payload_kg = self._wanted_kg
        self._manner = None

    def demand_by(self, command: Command) -> Demand:
        """Return what this command would demand. NotFiniteError as `demand_of`."""
        return self._turned(demand_of(command, self._settings))

    def _turned(self, demand: Demand) -> Demand:
        if self._direction > 0.0:
            return demand
        return demand._replace(manner=demand.manner._replace(gravity_n=-demand.manner.gravity_n))

    def _update_demand(self) -> None:
        is_on_its_way = self._payload_kg != self._wanted_kg
        command = self.command._replace(payload_kg=self._payload_kg) if is_on_its_way else self.command
        try:
            demand = demand_of(command, self._settings, self._manner)
            self._manner = self._manner or manner_of(command, self._settings.defaults)
            self.demand, self.not_finite = self._turned(demand), ""
        except NotFiniteError as error:
            self.not_finite = str(error)

    @property
    def gravity_n(self) -> float:
        """Contact force that the payload's weight gives under the present command."""
        return self.demand.manner.gravity_n

    def start_lease(self, now_s: float) -> None:
        """Start the lease at enable: the master has one length of the lease to beat."""
        self._lease.start(now_s, self.command.peer)

    def let_no_beat_count(self) -> None:
        """Let nothing begin by a heartbeat of before."""
        self._lease.let_no_beat_count()

    @property
    def has_moved(self) -> bool:
        """Decide whether the heartbeat of a frame has moved since the lease was started."""
        return self._lease.has_moved

    def is_lease_lost(self, now_s: float, owner_connected: bool) -> bool:
        """Return whether the master is lost: disconnected, or without a heartbeat for one length of the lease."""
        return self._lease.is_lost(now_s, owner_connected)

    def is_within_lease(self, since_s: float, now_s: float) -> bool:
        """Return whether no more than one length of the lease has passed since then."""
        return self._lease.is_within(since_s, now_s)

    def lost_sentence(self, now_s: float, line: LineStatus) -> str:
        """Return how the loss of the master was seen."""
        return master_lost_sentence(line, self.lease_age_s(now_s), is_behind=self.command.has_waited)

    def lease_age_s(self, now_s: float) -> float:
        """Return the time since the lease was renewed, s."""
        return self._lease.age_s(now_s)

    def would_have_beaten_since(self, since_s: float, now_s: float, command: Command) -> bool:
        """Return whether the heartbeat of the master has changed since then, and lately, were this command taken now."""
        return self._lease.would_have_beaten_since(since_s, now_s, command.heartbeat, command.peer, command.channel)

    def would_start_lease(self, command: Command) -> bool:
        """Return whether this command is a takeover with a lease of its own, were it taken now."""
        return bool(command.control_word & _TAKE) and self._lease.would_start_for(command.peer)

    def is_taken_again(self, command: Command) -> bool:
        """Return whether this takeover is one of a program that stands still: its second, without a beat between."""
        return self._lease.is_taken_again(command.heartbeat, command.peer, command.channel)

    def would_beat_since(self, since_s: float, now_s: float, command: Command) -> bool:
        """Return whether the heartbeat has changed since then and within one length of the lease, were this command taken
        now."""
        return self._lease.would_be_fresh_since(since_s, now_s, command.heartbeat)

    @property
    def who(self) -> str:
        """Address of the master that sent the command."""
        return self.command.peer or "a command"
