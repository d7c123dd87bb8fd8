"""What a step answers of where its parts stand, the parts played: each bit, each force and each wish by itself."""

from math import isnan
from operator import attrgetter
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.codes.warning_bits import WarningBit
from gateway.control.decision import OutputComposer, safe_output
from gateway.control.inputs import LineStatus, Output
from gateway.control.sample_conditioning import Reading
from gateway.control.transitions import StepOutcome
from gateway.devices.valve_profile import ValveDirection
from gateway.registers.command import Command
from gateway.registers.words import CalibrationPhase, LimitedBy, Mode, State, StatusBit

READING = Reading(cell_n=11.0, contact_n=12.0, age_s=0.01, is_new=True, is_fresh=True, is_usable=True)


class Stand:
    """An output that is off and well; `says` composes it."""

    def __init__(self) -> None:
        self.machine = SimpleNamespace(
            state=State.OFF, is_enabled=False, fault=FaultCode.NONE, is_restarted=False, is_master_lost=False,
            is_ramping_down=False, outcome=StepOutcome(), hold=lambda demand: demand,
        )  # fmt: skip
        self.loop = SimpleNamespace(
            voltage_v=1.5, feedforward_v=1.4, trim_v=0.1, limited_by=LimitedBy.NONE, in_band=False, unreachable=False,
            is_trim_at_limit=False, applied_n=9.0, expected_n=10.0, settling=SimpleNamespace(is_noisy=False),
        )  # fmt: skip
        self.run = SimpleNamespace(phase=CalibrationPhase.IDLE, progress=0.25, eta_s=7.0, target_n=0.0)
        self.command = Command(force_setpoint_n=30.0, heartbeat=5, command_sequence=6)
        self.valve: Any = None
        self.conditioner: Any = SimpleNamespace(is_doubted=False)
        self.block = RefusalReason.NOT_READY

    def says(self, reading: Reading = READING, *, touching: bool = False, warns: int = 0) -> Output:
        commands = SimpleNamespace(command=self.command, demand=SimpleNamespace(force_n=20.0))
        parts: Any = SimpleNamespace(loop=self.loop, run=self.run, commands=commands)
        readiness: Any = SimpleNamespace(enable_block=lambda *_: self.block)
        machine: Any = self.machine
        composer = OutputComposer(parts, machine, readiness, self.conditioner, self.valve)
        return composer.compose(1.0, reading, LineStatus(warnings=WarningBit(warns)), touching, 0.5)


def switched(*, is_pulling: bool = False, is_switching: bool = False) -> SimpleNamespace:
    return SimpleNamespace(is_pulling=is_pulling, is_switching=is_switching, order=ValveDirection.PULL)


BITS = {
    StatusBit.ENABLED: ("machine", "is_enabled", True),
    StatusBit.READY: ("", "block", RefusalReason.NONE),
    StatusBit.IN_BAND: ("loop", "in_band", True),
    StatusBit.FAULT: ("machine", "state", State.FAULT),
    StatusBit.LIMITED: ("loop", "limited_by", LimitedBy.FORCE_RANGE),
    StatusBit.TARGET_UNREACHABLE | StatusBit.WARNING: ("loop", "unreachable", True),
    StatusBit.PULLING: ("", "valve", switched(is_pulling=True)),
    StatusBit.SWITCHING: ("", "valve", switched(is_switching=True)),
}


@pytest.mark.parametrize("bit", BITS, ids=str)
def test_each_bit_of_the_status_says_one_thing(bit: StatusBit) -> None:
    stand = Stand()
    assert stand.says().status == StatusBit(0)
    part, name, value = BITS[bit]
    setattr(getattr(stand, part) if part else stand, name, value)
    assert stand.says().status == bit


def test_contact_is_a_bit_of_its_own() -> None:
    assert Stand().says(touching=True).status == StatusBit.CONTACT


WARNINGS = {
    WarningBit.RESTARTED: ("machine", "is_restarted"),
    WarningBit.MASTER_LOST: ("machine", "is_master_lost"),
    WarningBit.TARGET_UNREACHABLE: ("loop", "unreachable"),
    WarningBit.TRIM_SATURATED: ("loop", "is_trim_at_limit"),
    WarningBit.FORCE_UNSTEADY: ("loop.settling", "is_noisy"),
    WarningBit.ZERO_DOUBTED: ("conditioner", "is_doubted"),
}


@pytest.mark.parametrize("bit", WARNINGS, ids=str)
def test_each_warning_says_one_thing_beside_those_of_the_line(bit: WarningBit) -> None:
    stand = Stand()
    assert stand.says().warnings == WarningBit(0)
    part, name = WARNINGS[bit]
    setattr(attrgetter(part)(stand), name, True)
    of_line = next(one for one in WarningBit if one not in WARNINGS)
    output = stand.says(warns=of_line)
    assert output.warnings == bit | of_line and output.status & StatusBit.WARNING


@pytest.mark.parametrize("missing", ["is_fresh", "is_usable"])
def test_a_force_that_is_stale_or_none_is_not_said(missing: str) -> None:
    output = Stand().says(READING._replace(**{missing: False}))  # type: ignore[arg-type]
    assert isnan(output.force_measured_n) and isnan(output.model_residual_n) and output.sample_age_s == 0.01


@pytest.mark.parametrize("is_pulling", [False, True])
def test_forces_are_said_as_the_cell_shows_them(is_pulling: bool) -> None:
    stand, sign = Stand(), -1.0 if is_pulling else 1.0
    stand.valve = switched(is_pulling=is_pulling)
    output = stand.says()
    assert (output.force_measured_n, output.model_residual_n) == (sign * 12.0, sign * 0.5)
    assert output.valve is ValveDirection.PULL


@pytest.mark.parametrize(
    ("state", "mode", "is_enabled", "is_ramping", "run_n", "accepted_n", "applied_n"),
    [
        (State.OFF, Mode.FORCE, False, False, 0.0, 0.0, 9.0),
        (State.HOLDING, Mode.FORCE, True, False, 0.0, 20.0, 9.0),
        (State.HOLDING, Mode.FORCE, True, True, 0.0, 0.0, 9.0),
        (State.HOLDING, Mode.VOLTAGE, True, False, 0.0, 0.0, 0.0),
        (State.CALIBRATING, Mode.VOLTAGE, True, False, 14.0, 14.0, 9.0),
        (State.CALIBRATING, Mode.FORCE, True, True, 14.0, 14.0, 9.0),
    ],
)
def test_the_accepted_force_is_what_is_pursued(
    state: State, mode: Mode, is_enabled: bool, is_ramping: bool, run_n: float, accepted_n: float, applied_n: float
) -> None:
    stand = Stand()
    stand.machine.state, stand.machine.is_enabled, stand.machine.is_ramping_down = state, is_enabled, is_ramping
    stand.command, stand.run.target_n = stand.command._replace(mode=mode), run_n
    output = stand.says()
    assert (output.force_accepted_n, output.force_applied_n, output.force_requested_n) == (accepted_n, applied_n, 30.0)


def test_everything_else_is_handed_on_as_it_is() -> None:
    stand = Stand()
    stand.machine.fault = FaultCode.CELL_LOST
    stand.machine.outcome = StepOutcome(["a", "b"], clear_command=True, release_owner=True, resets_device=True)
    output = stand.says()
    assert (output.voltage_v, output.feedforward_v, output.trim_v) == (1.5, 1.4, 0.1)
    assert (output.heartbeat_echo, output.sequence_echo, output.fault) == (5, 6, FaultCode.CELL_LOST)
    assert (output.calibration_phase, output.calibration_progress) == (CalibrationPhase.IDLE, 0.25)
    assert (output.calibration_time_left_s, output.enable_block, output.valve) == (7.0, RefusalReason.NOT_READY, None)
    assert output.events == ("a", "b") and output.clear_command and output.release_owner and output.resets_device
    assert not Stand().says().clear_command and not Stand().says().release_owner and not Stand().says().resets_device


def test_where_nothing_was_decided_the_rigs_safe_voltage_is_written_and_a_fault_is_latched() -> None:
    output = safe_output(FaultCode.INTERNAL, 0.7)
    assert (output.voltage_v, output.state, output.status) == (0.7, State.FAULT, StatusBit.FAULT)
    assert (output.fault, output.enable_block) == (FaultCode.INTERNAL, RefusalReason.FAULT_LATCHED)
    assert output.clear_command and "safe voltage written" in output.events[0]
    assert safe_output(FaultCode.INTERNAL).voltage_v == 0.0
