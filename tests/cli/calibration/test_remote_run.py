"""`calibrate` by Modbus against the real bank, with a stand-in for control: the lease is kept, and a fault is told."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.cli.calibration import remote_run
from gateway.cli.calibration.remote_run import RemoteRun
from gateway.cli.errors import CliError
from gateway.cli.master.client import Assignment, Frame, RefusedError
from gateway.cli.master.wires import TcpWire
from gateway.codes.faults import FaultCode
from gateway.processes import exit_codes
from gateway.registers import BankRules, Register, RegisterBank, RegisterMap
from gateway.registers.command import Command, Status
from gateway.registers.rig_rules import BASIC_BITS
from gateway.registers.words import CalibrationPhase, ControlBit, State


class ClimbingBank:
    """A bank whose ladder is over after four heartbeats, which its lease needs; with a fault where one is given."""

    def __init__(self, register_map: RegisterMap, fault: FaultCode, *, wants_proof: bool = False) -> None:
        bits = BASIC_BITS | ControlBit.START_CALIBRATION
        rules = BankRules(rig_name="cell", force_max_n=60.0, supported_bits=bits, require_byte_order_echo=wants_proof)
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
    def run(fault: FaultCode, *, wants_proof: bool = False):
        rig = ClimbingBank(register_map, fault, wants_proof=wants_proof)
        return rig, call("calibrate", "--yes", "--gateway", serve(rig.bank).address)

    return run


def test_the_heartbeat_is_kept_from_the_start_to_the_end(climbed) -> None:
    rig, answer = climbed(FaultCode.NONE)
    assert answer.exit_code == 0, answer.output
    assert len(rig.beats) > 4 and "calibration 3 is stored, not active" in answer.stdout


def test_a_rig_that_wants_proof_of_the_word_order_gets_it_from_us(climbed) -> None:
    """The user was told to write 1234.5 in the client's own word order."""
    _, answer = climbed(FaultCode.NONE, wants_proof=True)
    assert answer.exit_code == 0, answer.output


def test_a_fault_that_ends_the_run_is_told(climbed) -> None:
    _, answer = climbed(FaultCode.SAMPLE_STALE)
    assert answer.exit_code == 1
    assert f"{FaultCode.SAMPLE_STALE.code} " in answer.stderr and "force-gateway explain" in answer.stderr


class PlayedClient:
    """Says these phases in turn, and refuses the heartbeat where another master commands."""

    def __init__(self, *phases: CalibrationPhase, refuses: bool = False) -> None:
        self.phases, self.refuses = list(phases), refuses
        self.beats, self.written = 0, list[int]()

    def check_map(self) -> None:
        """It is the right one."""

    def read_values(self, registers: Sequence[Register]) -> list[SimpleNamespace]:
        phase = self.phases.pop(0)
        return [SimpleNamespace(value=float(phase if one.name == "calibration_phase" else 0)) for one in registers]

    def frames(self, assignments: Sequence[Assignment]) -> list[Frame]:
        return [Frame(0, (int.from_bytes(data, "big"),)) for _, data in assignments]

    def write(self, frame: Frame) -> None:
        self.written.append(frame.words[0])

    def write_values(self, assignments: Sequence[Assignment]) -> None:
        self.beats += 1
        if self.refuses:
            raise RefusedError(6, "write 1 at 4")

    def close(self) -> None:
        """Nothing is open."""


def remote(client: PlayedClient) -> RemoteRun:
    run = RemoteRun(TcpWire("cell-3", 5020), 1)
    run._client = client  # type: ignore[assignment]
    return run


def test_how_the_run_before_ended_is_not_how_this_one_does() -> None:
    """Registers keep it until the new run has begun; one that ends in the same way is told all the same."""
    stored, ladder = CalibrationPhase.STORED, CalibrationPhase.LADDER
    run = remote(PlayedClient(stored, stored, ladder, stored))
    run.begin()
    assert [run.look().phase for _ in range(3)] == ["idle", "ladder", "stored"]
    run.stop()
    run.close()
    start, _, stop = run._client.written  # type: ignore[attr-defined]
    assert (start, stop) == (ControlBit.START_CALIBRATION, 0)


def test_a_heartbeat_that_is_refused_is_not_repeated(monkeypatch: pytest.MonkeyPatch) -> None:
    """Another master has the setpoint: its refusal registers and its log are not to be filled."""
    monkeypatch.setattr(remote_run, "DEFAULT_PERIOD_S", 0.001)
    run = remote(client := PlayedClient(CalibrationPhase.IDLE, refuses=True))
    run.begin()
    run._beat.join(5.0)
    assert not run._beat.is_alive() and client.beats == 1
    run.close()


def test_a_heartbeat_goes_round(monkeypatch: pytest.MonkeyPatch) -> None:
    """In a run of hours: behind the last number of a word comes 0, and the beats go on."""
    monkeypatch.setattr(remote_run, "DEFAULT_PERIOD_S", 0.0)
    run = remote(client := PlayedClient(CalibrationPhase.IDLE))
    beats: list[int] = []

    def hear(assignments: Sequence[Assignment]) -> None:
        beats.append(int.from_bytes(assignments[0].data, "big"))
        if len(beats) > 0x10000:
            raise RefusedError(6, "write 1 at 4")

    monkeypatch.setattr(client, "write_values", hear)
    run._number = 0
    run.begin()
    run._beat.join(20.0)
    assert not run._beat.is_alive() and beats == [*range(1, 0x10000), 0, 1]
    run.close()


def test_a_heartbeat_whose_answer_is_lost_is_followed_by_the_next(monkeypatch: pytest.MonkeyPatch) -> None:
    """One that noise took must not be the last: the lease would end the run."""
    monkeypatch.setattr(remote_run, "DEFAULT_PERIOD_S", 0.001)
    run = remote(client := PlayedClient(CalibrationPhase.IDLE))
    answers = [CliError("E131 no answer"), CliError("E131 no answer"), RefusedError(6, "write 1 at 4")]

    def lose(assignments: Sequence[Assignment]) -> None:
        client.beats += 1
        raise answers.pop(0)

    monkeypatch.setattr(client, "write_values", lose)
    run.begin()
    run._beat.join(5.0)
    assert not run._beat.is_alive() and client.beats == 3
    run.close()


def test_a_start_of_which_nobody_tells_any_more_may_have_been_heard(monkeypatch: pytest.MonkeyPatch) -> None:
    """The lost answer alone was told, which reads as one that has begun nothing."""
    run = remote(client := PlayedClient(CalibrationPhase.IDLE))

    def lose(*_: object) -> None:
        monkeypatch.setattr(client, "read_values", lose)
        raise CliError("E131 no answer", exit_codes.DEVICE)

    monkeypatch.setattr(client, "write", lose)
    with pytest.raises(CliError) as told:
        run.begin()
    assert told.value.exit_code == exit_codes.DEVICE
    assert str(told.value) == f"E131 no answer\nthe start was sent, and may have been heard; {run.lost_words}"


def test_before_a_run_elsewhere_its_force_is_asked_for_and_no_number_of_ours(call: Any) -> None:
    answer = call("calibrate", "--gateway", "127.0.0.1:1", input="n\n")
    assert "takes the largest force that its rig file allows" in answer.stderr and "60 N" not in answer.stderr
