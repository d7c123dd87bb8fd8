"""`hold` as a person or a script has it: its time, its refusals, its lines, and the words of each end."""

import errno
import json
import os
import sys
import threading
from dataclasses import replace
from io import StringIO
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.cli.errors import CliError
from gateway.cli.force_hold.heartbeat import HeartbeatThread, KnownLease
from gateway.cli.force_hold.sequence import HoldEnd, HoldRun, HoldWrite, StatusReading
from gateway.cli.force_hold.state_line import StateLine, describe_state, document
from gateway.cli.master.client import GatewayClient
from gateway.cli.master.wires import TcpWire
from gateway.cli.verbs.operation import hold
from gateway.codes.warning_bits import WarningBit
from gateway.registers import RegisterMap
from gateway.registers.words import State, StatusBit

PRESSING = StatusReading(State.HOLDING, applied_n=12.0)


@pytest.mark.parametrize("time", ["50ms", "0.001ms"])
def test_it_lets_go_by_itself_when_its_time_is_over(time: str, fake: Any, call: Any) -> None:
    """Its time begins with its enable: what a busy machine takes until then made a short hold none at all."""
    fake.bank.set("state", State.HOLDING)
    done = call("hold", "12", "--for", time, "--json", "--gateway", fake.address)
    assert done.exit_code == 0, done.output
    assert json.loads(done.output.splitlines()[-1]) == {"end": "stopped"}
    commands = [words[:2] for address, words in fake.bank.writes if not address]
    assert commands == [(1, 1200), (1, 0), (0, 0)], "by a ramp, not by a drop"


def test_its_time_is_over_also_where_nobody_takes_its_lines(fake: Any, call: Any, monkeypatch) -> None:
    """A paused terminal, a full pipe: it pressed on until somebody read. The first line comes before the time is over."""
    let_go, write, seen = threading.Event(), fake.bank.write_registers, []

    def note(address: int, data: bytes, peer: Any) -> None:
        write(address, data, peer)
        if fake.bank.writes[-1][1][:2] == (0, 0):
            let_go.set()

    monkeypatch.setattr(fake.bank, "write_registers", note)
    monkeypatch.setattr(StateLine, "show", lambda *_: seen.append(let_go.wait(5.0)))
    fake.bank.set("state", State.HOLDING)
    call("hold", "12", "--for", "500ms", "--gateway", fake.address)
    assert fake.bank.writes[0][1][:2] == (1, 1200) and seen and all(seen)


@pytest.mark.parametrize("trouble", [errno.ENOSPC, errno.EIO], ids=["full disk", "no terminal"])
def test_a_line_that_cannot_be_shown_leaves_no_force_behind(trouble: int, fake: Any, call: Any, monkeypatch) -> None:
    def fail(*_: object) -> None:
        raise OSError(trouble, os.strerror(trouble))

    monkeypatch.setattr(StateLine, "show", fail)
    fake.bank.set("state", State.HOLDING)
    call("hold", "12", "--gateway", fake.address)
    assert fake.bank.writes[0][1][:2] == (1, 1200) and fake.bank.writes[-1][1][:2] == (0, 0)


@pytest.mark.parametrize("newton", ["-3", "nan", "inf", "1e9"])
def test_a_force_that_is_none_is_refused_before_anything_is_asked(fake: Any, call: Any, newton: str) -> None:
    done = call("hold", newton, "--gateway", fake.address)
    assert done.exit_code == 2 and fake.bank.reads == fake.bank.writes == []


def test_a_stop_before_it_began_asks_for_nothing() -> None:
    run = HoldRun(12.0, heartbeat=0, resets=False)
    assert run.next(StatusReading(State.OFF), 0.0, stops=True) is None and run.end is HoldEnd.STOPPED


def test_where_no_fault_is_latched_nothing_is_reset() -> None:
    run = HoldRun(12.0, heartbeat=0, resets=True)
    assert run.next(StatusReading(State.OFF), 0.0, stops=False) == HoldWrite(1, 1, 12.0)


def test_a_force_that_nobody_can_tell_is_not_waited_for_on_the_way_down() -> None:
    run = HoldRun(12.0, heartbeat=0, resets=False)
    run.next(StatusReading(State.OFF), 0.0, stops=False)
    assert run.next(PRESSING, 0.1, stops=True) == HoldWrite(2, 1, 0.0)
    assert run.next(replace(PRESSING, applied_n=float("nan")), 0.2, stops=True) == HoldWrite(3, 0)


def lost(register_map: RegisterMap, lease: KnownLease | None, *, has_pressed: bool) -> str:
    client = GatewayClient(TcpWire("cell-3", 5020), 1, register_map)
    run = HoldRun(12.0, heartbeat=0, resets=False)
    if has_pressed:
        run.next(StatusReading(State.OFF), 0.0, stops=False)
    return HeartbeatThread(client, run, lease, lambda: 0.0)._lost_words(CliError("E131 cell-3:5020: gone"))


def test_a_lost_gateway_is_told_with_what_it_does_now(register_map: RegisterMap) -> None:
    for lease in (None, KnownLease(None), KnownLease(0.2)):
        assert lost(register_map, lease, has_pressed=False).endswith("; nothing had been enabled")
    assert "it goes on pressing 12 N until it is told otherwise" in lost(
        register_map, KnownLease(None), has_pressed=True
    )
    assert lost(register_map, KnownLease(0.2), has_pressed=True).endswith(
        "the lease of 200 ms is over: safe voltage, fault A310"
    )
    assert "without one the gateway goes on pressing 12 N: look at it" in lost(register_map, None, has_pressed=True)


def ended(end: HoldEnd, warned: WarningBit = WarningBit(0), failure: Exception | None = None) -> Any:  # noqa: B008
    run = SimpleNamespace(end=end, force_n=12.0, is_pressing=True, is_unheard=False)
    return SimpleNamespace(hold=run, failure=failure, status=PRESSING, warned=warned)


@pytest.mark.parametrize(
    ("warned", "code"),
    [(WarningBit.MASTER_LOST, "A310"), (WarningBit.RESTARTED, "A401"), (WarningBit(0), "W336")],
)
def test_who_has_disabled_it_is_told_by_the_warnings_that_there_were(warned: WarningBit, code: str) -> None:
    with pytest.raises(CliError, match=code):
        hold._report_end(ended(HoldEnd.DISABLED, warned), "cell-3", as_json=False)


def test_a_failure_is_no_good_end_for_a_script(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(CliError, match="E180"):
        hold._report_end(ended(HoldEnd.STOPPED, failure=CliError("E180 lost")), "cell-3", as_json=True)
    assert json.loads(capsys.readouterr().out) == {"end": "failed"}


def test_an_older_gateway_says_nothing_of_its_lease(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gateway.cli.master.local_gateways.running_behind", lambda *_: {"port": 5020, "lease_s": 0.2})
    assert hold._find_gateway_lease(TcpWire("127.0.0.1", 5020)) is None


def test_in_band_is_said_where_it_is_so() -> None:
    inside = replace(PRESSING, bits=StatusBit.IN_BAND)
    assert document(inside, 1.0)["in_band"] is True and document(PRESSING, 1.0)["in_band"] is False
    assert "  in band" in describe_state(inside) and "  not in band" in describe_state(PRESSING)


def test_each_number_of_a_line_of_json_stands_under_its_name_in_the_unit_of_that() -> None:
    told = document(replace(PRESSING, force_n=11.98, setpoint_n=12.5, voltage_v=1.512, warnings=1 << 2), 1.0)
    numbers = {name: told[name] for name in ("force_n", "setpoint_n", "applied_n", "voltage_v")}
    assert numbers == {"force_n": 11.98, "setpoint_n": 12.5, "applied_n": 12.0, "voltage_v": 1.512}
    assert (told["state"], told["warnings"], told["fault"]) == ("holding", ["A340"], None)


@pytest.mark.parametrize("time", ["0s", "0", "soon"])
def test_no_time_is_no_press_of_a_moment(time: str, call: Any) -> None:
    """Nothing is asked of anybody: there is no gateway."""
    done = call("hold", "12", "--for", time, "--gateway", "127.0.0.1:1")
    assert done.exit_code == 2 and f"{time} is no time such as 10s" in done.output


def test_a_warning_that_comes_is_a_line_at_once_where_there_is_no_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    line = StateLine(as_json=False)
    for at_s, warnings in ((0.0, 0), (0.1, 0), (0.2, 1 << 2), (0.3, 1 << 2)):
        line.show(replace(PRESSING, warnings=WarningBit(warnings)), at_s)
    assert [one.split()[0] for one in capsys.readouterr().out.splitlines()] == ["0.0", "0.2"]


@pytest.mark.parametrize(("term", "is_live"), [("xterm", True), ("dumb", False)])
def test_a_dumb_terminal_gets_the_lines_of_a_pipe(term: str, is_live: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """In Emacs it showed the orders to write over the line, ten times a second, in one line without an end."""
    monkeypatch.setenv("TERM", term)
    with StringIO() as terminal:
        monkeypatch.setattr(terminal, "isatty", lambda: True)
        monkeypatch.setattr(sys, "stdout", terminal)
        StateLine(as_json=False).show(PRESSING, 0.0)
        assert ("\x1b" in terminal.getvalue(), terminal.getvalue().endswith("\n")) == (is_live, not is_live)
