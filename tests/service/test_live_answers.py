"""What processes beside control are told and may ask: the state as control has it, and Modbus by the rules of any face."""

import json
import time
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

from gateway.codes.faults import FaultCode
from gateway.codes.warning_bits import WarningBit
from gateway.live.live_state import LiveLine, LiveState
from gateway.profiles import load_rig
from gateway.registers.words import ControlBit, State
from gateway.service.live_answers import AlarmTimes, _age_s, clock_sentence
from gateway.service.optional_children import Listeners, optional_children
from gateway.service.running_rig.starting import StartError
from tests.control.bench import bsfm
from tests.service.requests.stage import Stage, stage
from tests.service.rigs import demo
from tests.service.running_rig.lines.test_valve_line import Relay
from tests.service.wired import Wired

__all__ = ["stage"]

ENABLE_12_N = "10000000020400" + "01" + "04b0"
DISABLE = "060000" + "0000"


def ask(stage: Stage, request: dict[str, Any]) -> dict[str, Any]:
    return stage.ask(json.dumps(request).encode())


def send(stage: Stage, pdu: str, via: str = "web") -> str:
    return str(ask(stage, {"do": "modbus", "via": via, "pdu": pdu})["pdu"])


def test_a_command_by_the_page_is_held_shown_and_owned_by_it(stage: Stage) -> None:
    assert send(stage, ENABLE_12_N) == "1000000002"
    stage.wired.until(lambda: stage.wired.state is State.HOLDING, 3.0)
    state = LiveState.from_json(ask(stage, {"do": "state"}))
    assert (state.rig, state.state, state.owner) == ("demo", "holding", "web")
    assert state.force.requested_n == 12.0 and state.force.measured_n == pytest.approx(12.0, abs=1.0)
    assert state.writers["force_setpoint"].peer == "web"
    assert [peer.identity for peer in state.peers] == ["10.0.0.5"]
    assert state.load_cell.heard > 20 and state.limits.tolerance_n == 1.0


def test_the_line_of_a_valve_is_told_and_none_where_there_is_no_valve(stage: Stage) -> None:
    """The third serial line of a rig that pulls was nowhere to be seen while it failed."""
    told = lambda: LiveState.from_json(ask(stage, {"do": "state"})).valve  # noqa: E731
    assert told() == LiveLine()
    relay = Relay()
    stage.wired.loop.valve = relay.line
    stage.server.live._rig = replace(stage.wired.rig, valve=load_rig("paper-pull").valve)
    never = told()
    assert (never.port, never.device, never.asked, never.age_s) == ("/dev/pts/3", "waveshare-relay", 0, None)
    relay.now_s = stage.wired.now_s - 1.0
    relay.run(1.0)
    heard = told()
    assert (
        heard.asked == len(relay.asked) >= 10 and heard.heard in (heard.asked, heard.asked - 1) and heard.age_s == 0.0
    )
    relay.is_deaf = True
    relay.line.on_bytes(b"\xff" * 300, relay.now_s)
    stage.wired.run(2.0)
    silent = told()
    assert silent.heard == heard.heard and silent.garbled > 0 and silent.asked > heard.asked
    assert silent.age_s == pytest.approx(1.9, abs=0.15)


def test_what_its_caller_has_given_up_presses_nothing_and_what_is_always_wanted_stops(stage: Stage) -> None:
    """The socket has a tenth of the loop: an enable behind many questions pressed seconds after its page had called it off."""
    late = {"do": "modbus", "via": "web", "pdu": ENABLE_12_N, "until_s": stage.wired.now_s - 0.001}
    assert ask(stage, late) == {"ok": False, "error": "it waited for longer than whoever asked: nothing was done"}
    assert stage.wired.bank.owner is None
    assert ask(stage, late | {"until_s": stage.wired.now_s + 0.001})["pdu"] == "1000000002"
    stage.wired.run(0.5)
    assert send(stage, DISABLE) == DISABLE
    assert stage.wired.bank.owner is None


def test_nothing_begins_by_a_line_that_has_waited_behind_others_of_its_caller_and_a_stop_is_obeyed(
    stage: Stage,
) -> None:
    """A caller that piled up heartbeats and hung kept its force for ten seconds and more."""

    def send_late(pdu: str) -> dict[str, Any]:
        line = json.dumps({"do": "modbus", "via": "web", "pdu": pdu}).encode()
        answer = stage.server.answer(line, has_waited=True)
        assert isinstance(answer, bytes)
        return dict(json.loads(answer))

    assert "wait for each answer" in send_late(ENABLE_12_N)["refusal"]
    assert send(stage, ENABLE_12_N) == "1000000002"
    stage.wired.run(0.5)
    assert send_late(DISABLE)["pdu"] == DISABLE
    stage.wired.run(0.1)
    assert stage.wired.state is State.OFF


def test_who_does_not_own_the_setpoint_may_stop_and_nothing_else(stage: Stage) -> None:
    stage.wired.write(0, 1, 1000)
    assert send(stage, "0600010320") == "8606", "8 N, refused: another master owns the setpoint"
    assert (
        "owner" in ask(stage, {"do": "state"})["last_refusal"] or "owns" in ask(stage, {"do": "state"})["last_refusal"]
    )
    assert send(stage, DISABLE) == DISABLE
    stage.wired.run(0.1)
    assert stage.wired.state is State.OFF


def test_limits_are_those_that_a_setpoint_meets(stage: Stage) -> None:
    run = stage.wired.controller.active_run
    run.use(bsfm())  # of 57 N
    stage.wired.write(11, 50)
    limits = LiveState.from_json(ask(stage, {"do": "state"})).limits
    assert (limits.force_max_n, limits.tolerance_n) == (57.0, 0.5)
    run.use(replace(bsfm(), limits_n=(2.0, 25.3)))
    limits = LiveState.from_json(ask(stage, {"do": "state"})).limits
    assert (limits.force_min_n, limits.force_max_n) == (2.0, 25.3)


def test_the_largest_setpoint_of_a_pull_is_told_while_it_is_asked_for_and_taken(tmp_path: Path) -> None:
    """The page offered 60 N, and 34 N were refused by W309."""
    stage = Stage(tmp_path, Wired(load_rig("paper-pull")).ready())
    told = lambda: LiveState.from_json(ask(stage, {"do": "state"})).limits.force_max_n  # noqa: E731
    pushed_n = told()
    send(stage, f"060000{ControlBit.VALVE_PULL:04x}")
    most_n = told()
    assert most_n == pytest.approx(0.75 * pushed_n, rel=0.1)
    assert most_n == round(most_n, 2) <= stage.wired.controller.most_pull_n(), "as a word can say it, and never more"
    assert send(stage, f"060001{round(100.0 * most_n) + 1:04x}") == "8603"
    assert "W309" in ask(stage, {"do": "state"})["last_refusal"]
    assert send(stage, f"060001{round(100.0 * most_n):04x}")[:2] == "06"
    send(stage, DISABLE)
    assert told() == pushed_n
    stage.close()


def test_the_largest_setpoint_of_a_pull_is_never_told_as_more_than_is_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stage = Stage(tmp_path, Wired(load_rig("paper-pull")).ready())
    send(stage, f"060000{ControlBit.VALVE_PULL:04x}")
    monkeypatch.setattr(stage.wired.controller, "most_pull_n", lambda: 12.349)
    assert LiveState.from_json(ask(stage, {"do": "state"})).limits.force_max_n == 12.34
    stage.close()


def test_the_page_has_the_role_of_every_plain_face(stage: Stage) -> None:
    stage_order_2 = "0603e80002"
    assert send(stage, stage_order_2) == stage_order_2, "this rig allows uploads without a certificate"


def test_an_alarm_keeps_the_time_at_which_it_rose(stage: Stage) -> None:
    now_s = [1000.0]
    times = AlarmTimes(lambda: now_s[0], lambda: now_s[0])
    decision = stage.wired.loop.decision
    assert decision is not None
    times.follow(decision._replace(warnings=WarningBit.SLOW_LOOP))
    now_s[0] = 1060.0
    times.follow(decision._replace(warnings=WarningBit.SLOW_LOOP | WarningBit.SERIAL_NOISE))
    assert (times.since(WarningBit.SLOW_LOOP), times.since(WarningBit.SERIAL_NOISE)) == (1000.0, 1060.0)
    times.follow(decision)
    times.follow(decision._replace(warnings=WarningBit.SLOW_LOOP))
    assert times.since(WarningBit.SLOW_LOOP) == 1060.0


def test_a_fault_that_rises_alone_keeps_its_time_too(stage: Stage) -> None:
    now_s = [1000.0]
    times, decision = AlarmTimes(lambda: now_s[0], lambda: now_s[0]), stage.wired.loop.decision
    assert decision is not None
    for fault in (FaultCode.SAMPLE_STALE, FaultCode.SAMPLE_STALE, FaultCode.OVER_FORCE):
        times.follow(decision._replace(fault=fault))
        now_s[0] += 60.0
    assert (times.since(FaultCode.SAMPLE_STALE), times.since(FaultCode.OVER_FORCE)) == (now_s[0], 1120.0)


@pytest.mark.parametrize("set_s", [10 * 365 * 86400.0, -3600.0], ids=["ten years ahead", "an hour back"])
def test_an_alarm_has_stood_for_as_long_when_the_clock_is_set(stage: Stage, set_s: float) -> None:
    steady_s, ahead_s = [50.0], [1.7e9]
    times, decision = AlarmTimes(lambda: steady_s[0] + ahead_s[0], lambda: steady_s[0]), stage.wired.loop.decision
    assert decision is not None
    warns, told = decision._replace(warnings=WarningBit.SLOW_LOOP), list[float]()
    times.on_set = told.append
    times.follow(warns)
    for _ in range(60):
        steady_s[0] += 1.0
        ahead_s[0] += 5e-4  # as a clock is slewed
        times.follow(warns)
    ahead_s[0] += set_s
    times.follow(warns)
    assert steady_s[0] + ahead_s[0] - times.since(WarningBit.SLOW_LOOP) == pytest.approx(60.0, abs=0.1)
    times.follow(warns)
    assert told == [pytest.approx(set_s)], "once, for `events`: what stands above is dated by another clock"


def test_a_clock_that_is_set_is_told_with_how_far() -> None:
    assert [clock_sentence(set_s).split(":")[0] for set_s in (259_200.25, -3600.0)] == [
        "the clock was set forward by 259200.2 s",
        "the clock was set back by 3600.0 s",
    ]


def test_a_taken_address_ends_the_start_unless_any_will_do() -> None:
    first = Listeners({})
    first.open(demo(), {"web": ["127.0.0.1", 0], "metrics": ["127.0.0.1", 0]})
    host, port = first.addresses["web"]
    assert port and first.addresses["metrics"][1] not in (0, port)
    with pytest.raises(StartError, match=rf"^E127 --web {host}:{port}: Address already in use; another --web"):
        Listeners({}).open(demo(), {"web": [host, port]})
    usual = [Listeners({}), Listeners({})]
    notes = [listeners.open(demo(), {"web": ["", 0]}) for listeners in usual]
    assert usual[0].addresses["web"][1] != usual[1].addresses["web"][1], "a free one where the usual one is taken"
    assert f"the page is on {usual[1].addresses['web'][1]}" in notes[1][0]
    kept = Listeners({"web": [host, port]})
    kept.open(demo(), {"web": [host, port]})
    assert kept.sockets == {} and kept.addresses == {"web": (host, port)}, "the guardian has it already"
    children = optional_children(replace(demo(), simulated=True), None, first.addresses)
    again = {"simulated": True, "fingerprint": demo().fingerprint}
    assert children["web"] == again | {"settings": {"host": host, "port": port}}
    for listeners in (first, *usual):
        listeners.close()


def test_a_page_that_others_can_reach_needs_a_token() -> None:
    with pytest.raises(StartError, match=r"^E128 0\.0\.0\.0:0 can be reached from other machines: .*token"):
        Listeners({}).open(demo(), {"web": ["0.0.0.0", 0]})


@pytest.mark.parametrize("zone", ["JST-9", "HST10"])
def test_a_calibration_s_date_without_a_zone_is_utc(monkeypatch: pytest.MonkeyPatch, zone: str) -> None:
    """Whatever the machine's own is: a page showed one of this hour as half a day old."""
    monkeypatch.setenv("TZ", zone)
    time.tzset()
    try:
        moment = datetime.now(UTC) - timedelta(hours=12.0)
        for date in (moment.isoformat(), moment.replace(tzinfo=None).isoformat()):
            assert _age_s(date) == pytest.approx(12.0 * 3600.0, abs=5.0)
    finally:
        monkeypatch.undo()
        time.tzset()
