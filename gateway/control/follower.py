"""Follows the command block: which bits rose and fell, what is demanded, and whether the heartbeat moved."""

from dataclasses import replace

from gateway.bsfm import Bsfm
from gateway.control.demand import Demand, demand_of
from gateway.control.lease import Lease
from gateway.control.limits import NotFiniteError, narrowed
from gateway.control.settings import ControlSettings
from gateway.registers.command import Command
from gateway.registers.words import ControlBit


class CommandFollower:
    """`demand` is the last one that made sense; `not_finite` names the number that did not, or is empty."""

    def __init__(self, settings: ControlSettings) -> None:
        self.command = Command()
        self.demand: Demand = demand_of(self.command, settings)
        self.not_finite = ""
        self.lease = Lease(settings.supervision.lease_s)
        self._settings = self._rig_settings = settings
        self._adopt_heartbeat = False

    def use(self, model: Bsfm) -> None:
        """Hold to the force limits of this calibration, too: the demand of the last command may become a smaller one."""
        limits = narrowed(self._rig_settings.limits, model.limits_n)
        self._settings = replace(self._rig_settings, limits=limits)
        self._demand()

    def expect_clearing(self) -> None:
        """The bank is asked to zero the command: the next heartbeat value is its doing and not a beat."""
        self._adopt_heartbeat = True

    def take(self, now_s: float, command: Command) -> tuple[int, int]:
        """Returns the control bits that rose and those that fell; none for a command that was taken before."""
        if command is self.command:
            return 0, 0
        before, after = int(self.command.control_word), int(command.control_word)
        self.command = command
        if self._adopt_heartbeat:
            self._adopt_heartbeat = False
            self.lease.adopt(command.heartbeat)
        self.lease.observe(now_s, command.heartbeat)
        self._demand()
        return after & ~before, before & ~after

    def reset_refused(self, now_s: float, faulted_s: float) -> str:
        """Why a reset of a fault of faulted_s is refused now; empty where it is not."""
        if self.command.control_word & ControlBit.ENABLE or self.command.force_setpoint_n != 0.0:
            return "W302 reset refused: write setpoint 0 and enable 0 with the reset bit"
        if not self.lease.is_fresh_since(faulted_s, now_s):
            return "W302 reset refused: the heartbeat has not changed since the fault"
        return ""

    def _demand(self) -> None:
        try:
            self.demand, self.not_finite = demand_of(self.command, self._settings), ""
        except NotFiniteError as error:
            self.not_finite = str(error)

    @property
    def who(self) -> str:
        return self.command.peer or "a command"
