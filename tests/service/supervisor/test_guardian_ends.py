"""The guardian's end, and children that come late or never: the safe voltage goes first, and nothing waits for what is gone."""

import pytest

from gateway.processes import exit_codes, message_link
from gateway.processes.exit_cause import EndCause, Ending
from gateway.processes.scheduling.scheduler_counters import ProcessorTime
from gateway.service.clean_shutdown_marker import CleanShutdownMarker
from gateway.service.supervisor.safe_line import SafeLine
from tests.service.supervisor.guarded import (
    PTYS,
    READY,
    SAFE_FRAME,
    FakeChild,
    FakeTurns,
    Scene,
    port,
)
from tests.service.supervisor.scripted_children import assert_comes_up, dies_after, lives, rig_lives, scene

__all__ = ["port", "scene"]


def test_a_stop_does_not_wait_for_a_process_that_does_not_go(scene, port):
    def script(child: FakeChild) -> None:
        dies_after(8, port, None)(child)
        child.is_immortal = True

    one = scene(script)
    one.run(lambda: len(one.said) == 2)
    began_s = one.now_s
    one.signals.send()
    assert one.run() == 0
    assert one.now_s == began_s


@pytest.mark.parametrize(
    ("turns", "letter", "cause"),
    [
        ([ProcessorTime(1.0, 5.0), ProcessorTime(1.01, 5.09)], "R", EndCause.MACHINE_BUSY),
        ([ProcessorTime(1.0, 5.0), ProcessorTime(1.09, 5.01)], "R", EndCause.STALLED),
        ([ProcessorTime(1.0, 5.0), ProcessorTime(1.0, 5.0)], "S", EndCause.STALLED),
        ([ProcessorTime(1.0, 5.0), ProcessorTime(1.0, 5.0)], "T", EndCause.STOPPED),
    ],
)
def test_a_silence_is_told_by_what_the_kernel_gave_the_loop(scene, port, turns, letter, cause):
    def script(child: FakeChild) -> None:
        dies_after(6, port, None)(child)
        child.counters = FakeTurns([*turns], letter)  # a second try has them as well

    one = scene(script, lives(port))
    assert one.run(lambda: len(one.starter.started) == 2) is None
    assert one.now_s == pytest.approx(100.1), "within the bound"
    assert Ending.from_json(one.starter.arguments[1]["restarted"]).cause is cause
    assert f"({ {'machine-busy': 'A403', 'stalled': 'A404', 'stopped': 'A405'}[cause.value] })" in one.said[0]


def test_a_busy_machine_that_ends_the_gateway_is_named_as_the_cause(scene, port):
    def script(child: FakeChild) -> None:
        dies_after(6, port, None)(child)
        child.counters = FakeTurns([ProcessorTime(0.0, 0.0), ProcessorTime(0.0, 0.1)], "R")

    one = scene(script)
    assert one.run() == 1
    assert "(6 machine-busy)" in one.said[-1]
    assert "A403" in one.said[-1]


def beats_until_told(one: Scene) -> list[message_link.Message]:
    """Control goes on beating; what it is told next."""
    for _ in range(100):
        one.now_s += 0.01
        one.child.say(message_link.HEARTBEAT)
        assert one.guardian._step() is None, one.said
        if heard := one.child.hears():
            return heard
    raise AssertionError(f"control was told nothing: {one.said}")


def test_a_rig_that_dies_is_started_again_and_control_learns_where_it_is_now(scene, port):
    moved = {"output": "/dev/pts/7", "load_cell": "/dev/pts/8"}

    def second(child: FakeChild) -> None:
        child.say(message_link.PTYS, {"ptys": moved})

    one = scene(lives(port), rigs=(rig_lives, second))
    assert_comes_up(one)
    assert beats_until_told(one) == [message_link.Message(message_link.RIG, {"ptys": PTYS})]
    one.starter.rigs_started[0].dies(-9)
    assert beats_until_told(one) == [message_link.Message(message_link.RIG, {"ptys": moved})]
    assert one.said[0].startswith("A408 the simulated rig ended (SIGKILL)")
    assert one.starter.calls[-1] == "rig prepared=True", "as the files were when control was started, too"
    assert len(one.starter.started) == 1, "control was left alone"


def test_a_rig_that_dies_on_the_way_down_is_started_again_for_the_rest_of_it(scene, port):
    one = scene(lives(port), rigs=(rig_lives, rig_lives))
    assert_comes_up(one)
    beats_until_told(one)
    one.signals.send()
    assert [message.tag for message in beats_until_told(one)] == [message_link.STOP]
    one.starter.rigs_started[0].dies(-9)
    assert [message.tag for message in beats_until_told(one)] == [message_link.RIG]


def test_a_rig_that_never_starts_is_told_to_control_in_the_end(scene, port):
    def dies(child: FakeChild) -> None:
        child.say(message_link.BORN, {"pid": 3})
        child.dies(1)

    one = scene(dies_after(2, port, None), rigs=(dies,))
    heard: list[message_link.Message] = []

    def told() -> bool:
        heard.extend(one.child.hears())
        return bool(heard)

    one.run(told)
    assert heard == [message_link.Message(message_link.RIG, {"failed": True})]
    assert [line[:4] for line in one.said] == ["A408", "A408", "A408", "A409"]


def test_a_stop_before_there_is_a_line_waits_for_nothing(scene, port):
    one = scene(dies_after(1, port, None))
    one.run(lambda: one.child.pid != 0)
    began_s = one.now_s
    one.signals.send()
    assert one.run() == 0
    assert one.now_s == began_s


def test_a_loop_that_falls_silent_while_it_ramps_down_is_not_waited_for(scene, port):
    """Its bound is that of any silence, 0.1 s here, and not the time that a ramp may take."""
    one = scene(lives(port))
    assert_comes_up(one)
    one.signals.send()
    assert one.run() == 0
    assert one.now_s == pytest.approx(100.1)
    assert port.wrote() == SAFE_FRAME
    assert any("stopped as asked" in line and "without a tick" in line for line in one.noted), one.noted


@pytest.mark.parametrize(
    ("acknowledged", "said"),
    [(True, "safe voltage acknowledged"), (False, "safe voltage not acknowledged: the tool may still press")],
)
def test_who_gives_up_says_whether_the_safe_voltage_stands(scene, port, monkeypatch, acknowledged, said):
    """It was called held, whatever the device had answered."""
    monkeypatch.setattr(SafeLine, "write_safe", lambda line: acknowledged)
    one = scene(dies_after(4, port))
    assert one.run() == 1
    assert one.said[-1].startswith("A402 five restarts")
    assert one.said[-1].endswith(f"the gateway stops, {said}")


@pytest.mark.parametrize("code", [exit_codes.DATA, exit_codes.PERMISSION, exit_codes.CONFIGURATION, exit_codes.DEVICE])
def test_who_has_told_why_it_cannot_start_is_not_started_again(scene, port, code):
    """Five more starts would tell it five times more, and a service's `Restart=` goes by the code."""
    one = scene(dies_after(1, port, code))
    assert one.run() == code
    assert len(one.starter.started) == 1 and one.said == []


@pytest.mark.parametrize(("code", "starts"), [(exit_codes.DEVICE, 2), (exit_codes.PERMISSION, 1)])
def test_a_device_that_is_away_later_is_started_for_again_and_a_permission_is_not(scene, port, code, starts):
    one = scene(dies_after(8, port, code), lives(port))
    one.run(lambda: len(one.starter.started) == 2 and one.guardian.announced, steps=40)
    assert len(one.starter.started) == starts


def test_who_gives_up_without_ever_a_line_claims_no_safe_voltage(scene, port):
    one = scene(dies_after(0, port))
    assert one.run() == 1
    assert one.said[-1].endswith("the gateway stops, no line was open")


def test_a_safe_voltage_that_nobody_acknowledges_is_told_at_the_end_too(scene, port, monkeypatch):
    """The person at the terminal saw a gateway that had stopped as asked, beside a tool that went on pressing."""
    one = scene(lives(port))
    assert_comes_up(one)
    monkeypatch.setattr(SafeLine, "write_safe", lambda line: False)
    one.signals.send()
    assert one.run() == 0
    assert one.said[-1].startswith("A314 stopped as asked: safe voltage not acknowledged: the tool may still press")
    assert not any("stopped as asked" in line for line in one.noted)


def test_how_long_a_silence_may_last_says_the_rig(scene, port):
    def script(child: FakeChild) -> None:
        dies_after(5, port, None)(child)
        child.say(message_link.READY, READY | {"stall_s": 0.5})

    one = scene(script, lives(port))
    assert_comes_up(one)
    began_s = one.now_s
    one.run(lambda: len(one.starter.started) == 2)
    assert one.now_s - began_s == pytest.approx(0.5)


def test_a_second_signal_waits_for_nothing(scene, port):
    one = scene(lives(port))
    assert_comes_up(one)
    began_s = one.now_s
    one.signals.send()
    assert one.run(lambda: one.guardian.stops == 1) is None
    one.signals.send()
    assert one.run() == 0
    assert one.now_s == began_s
    assert port.wrote() == SAFE_FRAME


def test_a_loop_that_has_sent_the_safe_voltage_may_take_its_time_to_close(scene, port):
    one = scene(lives(port))
    assert_comes_up(one)
    one.signals.send()
    one.child.say(message_link.SAFE)
    one.run(steps=3, until=lambda: one.guardian.control.is_safe)
    assert one.guardian._patience_s() == pytest.approx(5.0, abs=0.2)
    one.child.dies(0)
    assert one.run() == 0
    assert one.now_s < 100.1


def test_a_loop_that_does_not_end_after_the_safe_voltage_is_ended(scene, port):
    one = scene(lives(port))
    assert_comes_up(one)
    one.signals.send()
    one.child.say(message_link.SAFE)
    assert one.run() == 0
    assert one.now_s == pytest.approx(105.0, abs=0.2)


def test_whatever_ends_the_guardian_the_safe_voltage_goes_first(scene, port, monkeypatch):
    one = scene(lives(port))
    assert_comes_up(one)

    def broken(*_: object) -> None:
        raise RuntimeError("a defect of the guardian itself")

    monkeypatch.setattr(one.guardian, "_poll_others", broken)
    with pytest.raises(RuntimeError):
        one.run()
    one.guardian._close()
    assert port.wrote() == SAFE_FRAME


@pytest.mark.parametrize("has_ended_cleanly", [False, True])
def test_what_control_has_kept_is_left_to_the_next_start_where_it_does_not_end_by_itself(
    scene, port, has_ended_cleanly
):
    """A loop stood still while it was told to stop, and a frame that was lost before pressed behind the next start."""
    lost = {"lost_beats": {"10.0.0.2": [24]}}
    one = scene(lives(port))
    marker = CleanShutdownMarker(one.guardian.state)
    marker.mark_running()
    assert_comes_up(one)
    one.child.say(message_link.KEEP, lost)
    one.signals.send()
    if has_ended_cleanly:
        one.child.say(message_link.SAFE)
        one.run(steps=3, until=lambda: one.guardian.control.is_safe)
        marker.clear({"lost_beats": {"10.0.0.2": [25]}})
        one.child.dies(0)
    assert one.run() == 0
    one.guardian._close()
    assert marker.left == ({"lost_beats": {"10.0.0.2": [25]}} if has_ended_cleanly else lost)
    assert marker.mark_running() is not has_ended_cleanly


@pytest.mark.parametrize("is_late", [False, True], ids=["at-once", "behind-the-look"])
def test_who_is_told_to_end_with_the_guardian_is_not_said_to_be_started_again(scene, port, monkeypatch, is_late):
    """A machine that shuts down tells every process. It said that control went on, and when there would be another page: on a
    busy machine a child that was told behind us has died of it before we have looked for the signal."""
    ready = READY | {"optional": {"watch": {}}}

    def script(child):
        dies_after(5, port, None)(child)
        child.say(message_link.READY, ready)

    one = scene(script)
    assert_comes_up(one)
    looked = one.guardian.wait

    def signal_comes_behind(descriptors: list[int], timeout_s: float) -> set[int]:
        found = looked(descriptors, timeout_s)
        if found and is_late and not one.guardian.stops:
            one.signals.send()
        return found

    monkeypatch.setattr(one.guardian, "wait", signal_comes_behind)
    if not is_late:
        one.signals.send()
    one.starter.optionals_started[0].dies(-15)
    one.run(lambda: one.guardian.stops == 1)
    one.child.dies(0)
    assert one.run() == 0
    assert (one.said, len(one.starter.optionals)) == ([], 1)
