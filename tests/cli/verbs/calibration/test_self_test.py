"""`self-test` against the real bank, with a stand-in for control that decides after three heartbeats."""

import json
import os
import signal

import pytest

from gateway.cli.errors import CliError
from gateway.cli.verbs.calibration import self_test
from gateway.codes.faults import FaultCode
from gateway.processes import exit_codes
from gateway.registers import BankRules, RegisterBank, RegisterMap
from gateway.registers.command import Command, Status
from gateway.registers.rig_rules import BASIC_BITS
from gateway.registers.words import ControlBit, SelfTestResult, SelfTestVerdict

PASSED, WARNED, FAILED = SelfTestVerdict.PASSED, SelfTestVerdict.WARNED, SelfTestVerdict.FAILED
ITEMS = ("noise", "resolution", "zero", "sign", "scale", "response", "leak", "output_line", "cell_line")


class DecidingBank:
    """A bank whose self-test ends with these verdicts, or never. words: each control word that was accepted."""

    def __init__(self, register_map: RegisterMap, result: SelfTestResult, verdicts: dict[str, SelfTestVerdict]) -> None:
        bits = BASIC_BITS | ControlBit.START_SELF_TEST  # and this rig wants 1234.5 first, which is ours to write
        rules = BankRules(rig_name="demo", force_max_n=60.0, supported_bits=bits, require_byte_order_echo=True)
        self.bank = RegisterBank(register_map, rules, now=lambda: 0.0)
        self.bank.on_command = self.hear
        self.result, self.verdicts, self.beats = result, verdicts, set[int]()
        self.words: list[int] = []
        self.signal_at_start = 0
        self.fault = FaultCode.NONE

    def hear(self, command: Command) -> None:
        if self.signal_at_start and not self.words:
            os.kill(os.getpid(), self.signal_at_start)
        self.words.append(int(command.control_word))
        self.beats.add(command.heartbeat)
        is_over = len(self.beats) > 3 and self.result is not SelfTestResult.RUNNING
        result = self.result if is_over else SelfTestResult.RUNNING
        self.bank.self_test.show(1, result, self.verdicts if is_over else {})
        self.bank.publish(Status(fault_code=self.fault if is_over else FaultCode.NONE))


@pytest.fixture
def tested(register_map: RegisterMap, serve, call):
    def run(result: SelfTestResult, *options: str, fault: FaultCode = FaultCode.NONE, **verdicts: SelfTestVerdict):
        rig = DecidingBank(register_map, result, dict.fromkeys(ITEMS, PASSED) | verdicts)
        rig.fault = fault
        answer = call("self-test", "--gateway", serve(rig.bank).address, *options)
        return rig, answer

    return run


def test_it_starts_the_test_beats_while_it_runs_and_tells_each_verdict(tested) -> None:
    rig, answer = tested(SelfTestResult.PASSED)
    assert answer.exit_code == 0, answer.output
    assert rig.words[0] == ControlBit.START_SELF_TEST and len(rig.beats) >= 4
    assert [line.split()[0] for line in answer.output.splitlines()] == ["ok"] * 9 + ["self-test"]
    assert answer.output.splitlines()[-1] == "self-test 1 passed"


def test_a_failed_item_is_exit_code_1_and_a_warned_one_is_not(tested) -> None:
    _, failed = tested(SelfTestResult.FAILED, leak=FAILED)
    assert failed.exit_code == 1 and "FAIL  leak" in failed.output
    _, warned = tested(SelfTestResult.WARNED, scale=WARNED)
    assert warned.exit_code == 0 and "WARN  scale" in warned.output


def test_json_has_every_item(tested) -> None:
    _, answer = tested(SelfTestResult.STOPPED, "--json", sign=SelfTestVerdict.NOT_TESTED)
    facts = json.loads(answer.output)
    assert answer.exit_code == 1 and (facts["result"], facts["number"]) == ("stopped", 1)
    assert list(facts["items"]) == list(ITEMS) and facts["items"]["sign"]["verdict"] == "not tested"


def test_a_fault_that_is_about_no_item_is_told_where_nothing_else_says_why_it_failed(tested) -> None:
    """Of a valve that was silent: nine items passed or not tested, and `self-test 1 failed`."""
    _, answer = tested(SelfTestResult.FAILED, fault=FaultCode.VALVE_SILENT)
    assert answer.exit_code == 1 and answer.stderr.startswith("A355 ")
    _, answer = tested(SelfTestResult.FAILED, leak=FAILED)
    assert answer.exit_code == 1 and answer.stderr == ""


@pytest.mark.parametrize("options", [(), ("--json",)])
def test_a_fault_that_has_stopped_it_is_told(tested, options: tuple[str, ...]) -> None:
    """`self-test 1 stopped` was all that was said."""
    _, answer = tested(SelfTestResult.STOPPED, *options, fault=FaultCode.MASTER_LOST)
    assert answer.exit_code == 1 and answer.stderr.startswith("A310 master lost: ")
    assert "The self-test has stopped\n  " in answer.stderr and "force-gateway explain A310" in answer.stderr
    _, answer = tested(SelfTestResult.STOPPED, *options)
    assert answer.exit_code == 1 and not answer.stderr


def test_a_rig_without_one_refuses_with_what_to_do(register_map: RegisterMap, serve, call) -> None:
    bank = RegisterBank(register_map, BankRules(rig_name="irc5-cell", force_max_n=60.0), now=lambda: 0.0)
    answer = call("self-test", "--gateway", serve(bank).address)
    assert answer.exit_code == 1 and "W217" in answer.output and "irc5-cell" not in answer.stdout


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_whatever_ends_the_verb_ends_the_test_even_while_it_begins(
    number: int, register_map: RegisterMap, serve, call
) -> None:
    rig = DecidingBank(register_map, SelfTestResult.RUNNING, {})
    rig.signal_at_start = number
    address = serve(rig.bank).address
    before = signal.signal(number, signal.default_int_handler)
    try:
        answer = call("self-test", "--gateway", address)
    finally:
        signal.signal(number, before)
    assert answer.exit_code == 128 + number and "self-test stopped; the force went to 0" in answer.stderr
    assert (rig.words[0], rig.words[-1]) == (int(ControlBit.START_SELF_TEST), 0)


@pytest.mark.parametrize(("code", "stops"), [(exit_codes.DEVICE, 1), (exit_codes.FAILED, 0)])
def test_an_answer_that_is_lost_leaves_no_test_behind_and_a_refusal_disturbs_nobody(code: int, stops: int) -> None:
    """Refused is who has been overtaken: what presses then is another master's."""

    class Run:
        stopped = 0

        def begin(self) -> None: ...

        def may_run(self) -> bool:
            return True

        def follow(self, *, shows: bool) -> None:
            raise CliError("W210 or E131", code)

        def stop(self) -> None:
            self.stopped += 1

    run = Run()
    with pytest.raises(CliError, match="W210 or E131"):
        self_test._run_to_its_end(run, shows=False)  # type: ignore[arg-type]
    assert run.stopped == stops
