"""What comes first where control ends: the kill, so that it writes nothing more, then the safe voltage, then all that waits."""

import os

import pytest

from gateway.processes import message_link
from gateway.processes.exit_cause import EndCause, Ending
from gateway.service.supervisor.safe_line import SafeLine
from tests.service.supervisor.guarded import READY, SAFE_FRAME, FakeChild, Port, Scene, port
from tests.service.supervisor.scripted_children import assert_comes_up, dies_after, lives, scene

__all__ = ["port", "scene"]


def note_end(one: Scene, port: Port, patch: pytest.MonkeyPatch) -> list[tuple[str, bytes]]:
    """What is done to the present control process and to the others, and what had been written to the port since the last."""
    done: list[tuple[str, bytes]] = []
    child = one.child

    def noted(what: str, owner: object, name: str) -> None:
        then = getattr(owner, name)

        def act(*arguments: object) -> object:
            if what != "waited for" or arguments[0] == [child.died]:
                done.append((what, port.wrote()))
            return then(*arguments)

        patch.setattr(owner, name, act)

    noted("killed", child, "kill")
    noted("ended", child, "end")
    noted("others ended", one.starter, "end")
    noted("waited for", one.guardian, "wait")
    return done


def test_a_silent_loop_is_killed_then_the_voltage_is_safe_and_then_its_death_is_waited_for(scene, port, monkeypatch):
    """A driver may hold a killed process for as long as it likes."""
    one = scene(lives(port), lives(port))
    assert_comes_up(one)
    with monkeypatch.context() as patch:
        done = note_end(one, port, patch)
        assert one.run(lambda: len(one.starter.started) == 2) is None
    assert done == [("killed", b""), ("waited for", SAFE_FRAME)]


def test_why_a_loop_was_silent_is_asked_behind_the_safe_voltage(scene, port, monkeypatch):
    """The kernel's files may keep whoever reads them waiting, above all on the machine that is too busy."""
    one = scene(lives(port), lives(port))
    assert_comes_up(one)
    asked: list[bytes] = []

    def why() -> Ending:
        asked.append(port.wrote())
        return Ending(EndCause.STALLED, "it was silent")

    with monkeypatch.context() as patch:
        patch.setattr(one.guardian.control.heartbeat, "why_silent", lambda process, now_s: why)
        assert one.run(lambda: len(one.starter.started) == 2) is None
    assert asked == [SAFE_FRAME]


def test_at_the_end_nobody_is_waited_for_before_the_voltage_is_safe(scene, port, monkeypatch):
    """Each child has a second to end in order, when it is asked: force would stand for as long."""
    one = scene(lives(port))
    assert_comes_up(one)
    with monkeypatch.context() as patch:
        done = note_end(one, port, patch)
        one.guardian._close()
    assert done[0] == ("killed", b"")
    assert done[1][1] == SAFE_FRAME
    assert {what for what, _ in done[1:]} >= {"ended", "others ended"}


def test_the_line_that_was_handed_over_as_the_last_is_the_one_that_gets_the_safe_voltage(scene, port, monkeypatch):
    """The port has been opened again a moment before the kill."""
    opened_again = Port()
    one = scene(lives(port))
    assert_comes_up(one)
    kill = one.child.kill

    def last_word() -> None:
        if one.child.exit_code is None:
            handed = {"safe_frame": SAFE_FRAME.hex(), "safe_reply": "", "reply_end": ""}
            one.child.say(message_link.LINE, handed, opened_again.writer)
        kill()

    with monkeypatch.context() as patch:
        patch.setattr(one.child, "kill", last_word)
        one.run(lambda: len(one.starter.started) == 2)
    assert (port.wrote(), opened_again.wrote()) == (b"", SAFE_FRAME)
    opened_again.close()


def test_a_line_that_is_lost_is_kept_open_by_nobody_and_its_device_is_not_taken_for_told(scene, port):
    """An adapter that is plugged in again gets the name of the port, ttyUSB0, only when all have closed it."""
    lost = Port()
    one = scene(lives(lost), lives(port))
    assert_comes_up(one)
    one.child.say(message_link.LINE_LOST, {})
    one.run(lambda: one.guardian.control.safe_line is None)
    os.close(lost.writer)
    assert os.read(lost._reader, 64) == b"", "the end: nobody else could write there"
    os.close(lost._reader)
    one.child.dies(-9)
    one.run(lambda: len(one.starter.started) == 2)
    assert "safe voltage not acknowledged" in one.said[-1]
    assert_comes_up(one)
    one.child.dies(-9)
    one.run(lambda: len(one.starter.started) == 3)
    assert "safe voltage acknowledged" in one.said[-1], "the next one has a line of its own"


def test_a_line_that_one_process_has_lost_is_no_word_about_the_next_one(scene, port):
    """Which has opened none yet: there was nothing to be acknowledged."""
    one = scene(lives(port), lambda child: None)
    assert_comes_up(one)
    one.child.say(message_link.LINE_LOST, {})
    for count in (2, 3):
        one.child.dies(-9)
        one.run(lambda: len(one.starter.started) == count)  # noqa: B023
    lost, never_opened = (each for each in one.said if "control" in each)
    assert "not acknowledged" in lost
    assert "acknowledged" not in never_opened


@pytest.mark.parametrize("hears_itself", [True, False])
def test_what_control_has_found_of_its_adapter_counts_at_the_last_write(scene, port, hears_itself, monkeypatch):
    """Known once a question has come back, long behind the line itself."""
    one = scene(lives(port), lives(port))
    assert_comes_up(one)
    told: list[bool] = []
    monkeypatch.setattr(SafeLine, "write_safe", lambda line: bool(told.append(line.hears_itself)))
    one.child.say(message_link.KEEP, {"hears_itself": hears_itself})
    one.child.dies(-9)
    one.run(lambda: len(one.starter.started) == 2)
    assert told == [hears_itself]


def test_nonsense_is_an_end_at_once_and_nothing_that_follows_it_counts(scene, port):
    """Also before READY, where a silence would be waited for longer."""

    def script(child: FakeChild) -> None:
        dies_after(5, port, None)(child)
        child.theirs.send(b"r{}")
        child.say(message_link.FIRST_CAUSE, {"text": "internal error: ZeroDivisionError()"})
        child.say(message_link.READY, READY)

    one = scene(script, lives(port))
    assert one.run(lambda: len(one.starter.started) == 2) is None
    assert one.now_s == 100.0
    assert one.starter.started[0].exit_code == -9
    assert Ending.from_json(one.starter.arguments[1]["restarted"]).cause is EndCause.NONSENSE
    assert not one.guardian.announced


@pytest.mark.parametrize("words", [5, 8, "without a line"])
def test_a_stop_asks_whoever_has_a_line_or_a_loop_and_gives_it_time(scene, port, words):
    """5: the port is open and the rig is not ready yet. Without a line: the output's port is not there, a recording may be."""

    def no_line(child: FakeChild) -> None:
        child.say(message_link.BORN, {"pid": 1})
        child.say(message_link.READY, READY)

    one = scene(no_line if words == "without a line" else dies_after(words, port, None))
    one.run(lambda: one.guardian.control.safe_line is not None or one.guardian.control.heartbeat.is_up)
    one.run(lambda: not one.child.hears())
    one.signals.send()
    assert one.run(lambda: one.guardian.stops == 1) is None
    assert [message.tag for message in one.child.hears()] == [message_link.STOP]
    assert one.child.exit_code is None
    one.child.dies(0)
    assert one.run() == 0
    assert one.noted[-1].endswith("acknowledged") or one.noted[-1].endswith("no line was open"), "it ended by itself"


def test_a_stop_while_none_runs_starts_none(scene, port):
    """Between two tries of a control process that does not come up."""
    one = scene(dies_after(2, port, 1))
    one.run(lambda: len(one.starter.started) == 3 and one.guardian.control.process is None)
    one.signals.send()
    assert one.run() == 0
    assert len(one.starter.started) == 3


def test_a_word_that_the_voltage_is_safe_is_that_of_one_process(scene, port):
    """The next one's silence while it ramps down is not waited for."""

    def says_safe(child: FakeChild) -> None:
        dies_after(8, port, None)(child)
        child.say(message_link.SAFE)
        child.dies(1)

    one = scene(says_safe, lives(port))
    one.run(lambda: len(one.starter.started) == 2)
    assert_comes_up(one)
    one.signals.send()
    assert one.run() == 0
    assert one.now_s == pytest.approx(100.1)


def test_a_child_that_floods_its_line_keeps_the_guardian_from_nothing(scene, port, monkeypatch):
    """There is always one more message: the silence of the loop, and a signal, are looked at all the same."""
    one = scene(lives(port))
    assert_comes_up(one)
    flood, most = iter(range(3000)), 2000

    def endless(_: object) -> message_link.Message:
        assert next(flood) < most, "it reads for ever"
        return message_link.Message("?")

    with monkeypatch.context() as patch:
        patch.setattr(message_link, "receive", endless)
        one.child.say(message_link.HEARTBEAT)
        assert one.guardian._step() is None
