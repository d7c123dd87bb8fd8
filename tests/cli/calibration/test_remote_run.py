"""`calibrate` by Modbus against the real bank, with a stand-in for control: the lease is kept, and a fault is told."""

import pytest

from gateway.codes.faults import FaultCode
from gateway.registers import BankRules, RegisterBank, RegisterMap
from gateway.registers.command import Command, Status
from gateway.registers.rig_rules import BASIC_BITS
from gateway.registers.words import CalibrationPhase, ControlBit, State


class ClimbingBank:
    """A bank whose ladder is over after four heartbeats, which its lease needs; with a fault where one is given."""

    def __init__(self, register_map: RegisterMap, fault: FaultCode) -> None:
        rules = BankRules(rig_name="cell", force_max_n=60.0, supported_bits=BASIC_BITS | ControlBit.START_CALIBRATION)
        self.bank = RegisterBank(register_map, rules, now=lambda: 0.0)
        self.bank.on_command = self.hear
        self.fault, self.beats = fault, set[int]()

    def hear(self, command: Command) -> None:
        self.beats.add(command.heartbeat)
        is_over = len(self.beats) > 4
        ended = CalibrationPhase.STOPPED if self.fault else CalibrationPhase.STORED
        self.bank.publish(
            Status(
                state=State.CALIBRATING,
                calibration_phase=ended if is_over else CalibrationPhase.LADDER,
                calibration_stored=3,
                fault_code=self.fault if is_over else FaultCode.NONE,
            )
        )


@pytest.fixture
def climbed(register_map: RegisterMap, serve, call):
    def run(fault: FaultCode):
        rig = ClimbingBank(register_map, fault)
        return rig, call("calibrate", "--yes", "--gateway", serve(rig.bank).address)

    return run


def test_the_heartbeat_is_kept_from_the_start_to_the_end(climbed) -> None:
    rig, answer = climbed(FaultCode.NONE)
    assert answer.exit_code == 0, answer.output
    assert len(rig.beats) > 4 and "calibration 3 is stored, not active" in answer.stdout


def test_a_fault_that_ends_the_run_is_told(climbed) -> None:
    _, answer = climbed(FaultCode.SAMPLE_STALE)
    assert answer.exit_code == 1
    assert f"{FaultCode.SAMPLE_STALE.code} " in answer.stderr and "force-gateway explain" in answer.stderr
