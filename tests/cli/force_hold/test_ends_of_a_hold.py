"""The ends of a hold: how a person ends it, when it lets go on the way down, and that a fault is an error."""

import os
import signal
import threading
from collections.abc import Callable, Iterator
from itertools import count
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.cli.errors import CliError
from gateway.cli.force_hold.sequence import HoldEnd, HoldRun, StatusReading, status_reading_of
from gateway.cli.master.byte_order_proof import prove_byte_order
from gateway.cli.verbs.operation.hold import _handle_signals, _report_end
from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.codes.warning_bits import WarningBit
from gateway.registers.words import State


@pytest.fixture(autouse=True)
def terminal_may_end_it() -> Iterator[None]:
    """As where a person works; who runs these tests under nohup has them ignore the terminal's end."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)


def slow_hand(apart_s: float = 1.0) -> Callable[[], float]:
    """A clock on which signals are so far apart."""
    return count(1.0, apart_s).__next__


def test_under_nohup_the_end_of_the_terminal_ends_no_hold() -> None:
    beat: Any = SimpleNamespace(stopping=threading.Event(), dropping=threading.Event(), is_alive=lambda: True)
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    with _handle_signals(beat):
        os.kill(os.getpid(), signal.SIGHUP)
        assert not beat.stopping.is_set()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_first_signal_ramps_down_and_the_second_drops(number: int) -> None:
    beat: Any = SimpleNamespace(stopping=threading.Event(), dropping=threading.Event(), is_alive=lambda: True)
    with _handle_signals(beat, slow_hand()):
        os.kill(os.getpid(), number)
        assert beat.stopping.is_set() and not beat.dropping.is_set()
        os.kill(os.getpid(), number)
        assert beat.dropping.is_set()


@pytest.mark.parametrize(
    ("numbers", "apart_s"),
    [
        ((signal.SIGHUP, signal.SIGHUP), 1.0),
        ((signal.SIGTERM, signal.SIGHUP, signal.SIGHUP), 1.0),
        ((signal.SIGTERM, signal.SIGTERM), 0.02),
    ],
)
def test_what_is_said_more_than_once_by_one_end_drops_nothing(numbers: tuple[int, ...], apart_s: float) -> None:
    """A terminal that closes, a session that ends, `timeout`."""
    beat: Any = SimpleNamespace(stopping=threading.Event(), dropping=threading.Event(), is_alive=lambda: True)
    with _handle_signals(beat, slow_hand(apart_s)):
        for number in numbers:
            os.kill(os.getpid(), number)
        assert beat.stopping.is_set() and not beat.dropping.is_set()


def test_a_terminal_that_closes_while_the_force_goes_down_by_itself_drops_nothing() -> None:
    beat: Any = SimpleNamespace(stopping=threading.Event(), dropping=threading.Event(), is_alive=lambda: True)
    beat.stopping.set()
    with _handle_signals(beat, slow_hand()):
        os.kill(os.getpid(), signal.SIGHUP)
        assert not beat.dropping.is_set()


def ended(end: HoldEnd, fault: FaultCode = FaultCode.SAMPLE_STALE) -> Any:
    status = StatusReading(State.FAULT, fault)
    run = SimpleNamespace(end=end, force_n=12.0, is_pressing=True, is_unheard=False)
    return SimpleNamespace(hold=run, failure=None, status=status, warned=WarningBit(0))


def test_only_an_end_as_asked_is_none_to_tell_a_script_of() -> None:
    _report_end(ended(HoldEnd.STOPPED), "127.0.0.1:5020", as_json=False)
    with pytest.raises(CliError, match="A311"):
        _report_end(ended(HoldEnd.FAULT), "127.0.0.1:5020", as_json=True)
    with pytest.raises(CliError, match="W336"):
        _report_end(ended(HoldEnd.DISABLED), "127.0.0.1:5020", as_json=True)


def test_how_to_go_on_is_told_of_the_gateway_that_was_meant() -> None:
    """`force-gateway hold 12 --reset` stood there whatever --gateway had said: another cell's tool would have pressed."""
    with pytest.raises(CliError) as told:
        _report_end(ended(HoldEnd.FAULT), "10.0.0.5:5020", as_json=False)
    assert "then: the same command with --reset" in told.value.message and "hold 1" not in told.value.message


OUTPUT_FAULTS = [fault for fault in FaultCode if fault.name.startswith("OUTPUT_")]


@pytest.mark.parametrize(
    "fault", [FaultCode.SAMPLE_STALE, FaultCode.MASTER_LOST, *OUTPUT_FAULTS], ids=lambda one: one.name
)
def test_of_an_output_that_does_not_obey_nobody_is_told_that_it_is_at_the_safe_voltage(fault: FaultCode) -> None:
    with pytest.raises(CliError) as told:
        _report_end(ended(HoldEnd.FAULT, fault), "127.0.0.1:5020", as_json=False)
    is_sure = "The output is at the safe voltage" in told.value.format_message()
    assert is_sure is (fault not in OUTPUT_FAULTS)
    assert is_sure or "look at the tool" in told.value.format_message()


def test_it_lets_go_when_the_force_is_down_and_no_sooner() -> None:
    """A disable drops what is left at once: a newton that falls away marks the part."""
    run = HoldRun(12.0, heartbeat=0, resets=False)
    run.next(StatusReading(State.OFF), 0.0, stops=False)
    words = []
    for k, applied_n in enumerate((12.0, 6.0, 1.0, 0.4, 0.0)):
        write = run.next(StatusReading(State.HOLDING, applied_n=applied_n), 0.1 * k, stops=True)
        words.append(write and write.control_word)
    assert words == [1, None, None, None, 0] and run.end is HoldEnd.STOPPED


def test_the_voltage_is_told_in_volts() -> None:
    names = "state fault_code status_word limited_by warning_word force_measured force_requested force_applied"
    values = dict.fromkeys(names.split(), 0.0)
    assert status_reading_of(values | {"output_voltage": 1500.0}).voltage_v == 1.5


@pytest.mark.parametrize("reason", [RefusalReason.BYTE_ORDER_UNPROVEN, RefusalReason.FAULT_LATCHED])
def test_a_byte_order_is_shown_where_that_was_asked_for_and_else_the_refusal_stands(reason: RefusalReason) -> None:
    written = list[Any]()
    register = SimpleNamespace(encode=lambda value: value)
    client: Any = SimpleNamespace(
        register_map=SimpleNamespace(find=lambda name: register),
        read_values=lambda registers: [SimpleNamespace(value=float(reason))],
        write_values=written.extend,
    )
    is_proof = reason is RefusalReason.BYTE_ORDER_UNPROVEN
    assert prove_byte_order(client) is is_proof
    assert bool(written) is is_proof
