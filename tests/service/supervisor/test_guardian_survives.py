"""The guardian outlives every child, whenever and however it dies, and puts the safe voltage on the wire if there is a wire."""

import errno
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from gateway.processes import message_link
from gateway.processes.exit_cause import EndCause, Ending
from gateway.processes.scheduler_counters import ProcessorTime
from tests.service.supervisor.guarded import (
    PTYS,
    READY,
    SAFE_FRAME,
    FakeChild,
    FakeStarter,
    FakeTurns,
    Port,
    Scene,
    Script,
    port,
)

__all__ = ["port"]
Step = Callable[[FakeChild], None]


def start_of(port: Port) -> list[Step]:
    """Every word of a control process from its birth to the first heartbeats, one step each."""
    handed = {"safe_frame": SAFE_FRAME.hex(), "safe_reply": ""}
    return [
        lambda child: child.say(message_link.BORN, {"pid": 1}),
        lambda child: child.say(message_link.NEED_RIG, {"rig": "demo"}),
        lambda child: child.say(message_link.LINE, handed, port.writer),
        lambda child: child.say(message_link.HEARTBEAT),
        lambda child: child.say(message_link.LINE, handed, port.writer),
        lambda child: child.say(message_link.READY, READY),
        lambda child: child.say(message_link.HEARTBEAT),
        lambda child: child.say(message_link.HEARTBEAT),
    ]


def lives(port: Port) -> Script:
    return dies_after(len(start_of(port)), port, None)


def dies_after(steps: int, port: Port, code: int | None = -9) -> Script:
    """Plays so many steps, then dies with this code (None: it only falls silent)."""

    def script(child: FakeChild) -> None:
        for step in start_of(port)[:steps]:
            step(child)
        if code is not None:
            child.dies(code)

    return script


def rig_lives(child: FakeChild) -> None:
    child.say(message_link.BORN, {"pid": 2})
    child.say(message_link.PTYS, {"ptys": PTYS})


def open_descriptors() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


@pytest.fixture
def scene(tmp_path: Path) -> Iterator[Callable[..., Scene]]:
    scenes: list[Scene] = []

    def make(*controls: Script, rigs: tuple[Script, ...] = (rig_lives,)) -> Scene:
        scenes.append(Scene(tmp_path, FakeStarter(list(controls), list(rigs))))
        return scenes[-1]

    before = open_descriptors()
    yield make
    for one in scenes:
        one.close()
    assert open_descriptors() <= before, "the guardian keeps descriptors of children that are gone"


def assert_comes_up(one: Scene) -> None:
    assert one.run(lambda: one.guardian.control.heartbeat.is_up) is None, one.said


@pytest.mark.parametrize("code", [-9, 1, 0, None])
@pytest.mark.parametrize("steps", range(9))
def test_a_control_process_that_dies_at_the_nth_step_is_started_again(scene, port, steps, code):
    """n = 0, 1, ... until clean: with 8 steps it has lived. None: it hangs there instead, until it is overdue."""
    one = scene(dies_after(steps, port, code), lives(port))
    assert one.run(lambda: len(one.starter.started) == 2) is None
    had_line = steps >= 3
    assert port.wrote() == (SAFE_FRAME if had_line else b"")
    if not (steps == 0 and code is None):  # nobody has risked anything: the long way, which counts as no restart
        (line,) = [line for line in one.said if line.startswith("A401")]
        assert ("acknowledged" if had_line else "no line was open") in line
    assert_comes_up(one)
    restarted = Ending.from_json(one.starter.arguments[1]["restarted"])
    assert (restarted is None) is (steps == 0 and code is None)


class Failing:
    """A socket whose n-th call fails, counted over all lines, and from then on the line is dead."""

    def __init__(self, inner, countdown: list[int], error: int) -> None:
        self._inner, self._countdown, self._error = inner, countdown, error
        self._is_dead = False

    def _call(self, name, *arguments):
        self._countdown[0] -= 1
        if self._countdown[0] == 0 or self._is_dead:
            self._is_dead = True
            raise OSError(self._error, os.strerror(self._error))
        return getattr(self._inner, name)(*arguments)

    def sendmsg(self, *arguments):
        return self._call("sendmsg", *arguments)

    def recvmsg(self, *arguments):
        return self._call("recvmsg", *arguments)

    def fileno(self):
        return self._inner.fileno()

    def close(self):
        self._inner.close()


@pytest.mark.parametrize("error", [errno.EPIPE, errno.ECONNRESET, errno.EMFILE, errno.ENOBUFS])
def test_the_nth_call_on_any_line_may_fail_until_none_does(scene, port, error):
    """The child goes on beside its dead line, and is replaced; the guardian goes on in any case."""
    failed = 0
    for n in range(1, 100):
        countdown = [n]

        def script(child: FakeChild, countdown=countdown) -> None:
            child.link = Failing(child.link, countdown, error)
            dies_after(8, port, None)(child)

        def rig(child: FakeChild, countdown=countdown) -> None:
            child.link = Failing(child.link, countdown, error)
            rig_lives(child)

        one = scene(script, lives(port), rigs=(rig, rig_lives))
        assert one.run(lambda one=one: one.now_s > 160.0 or one.guardian.control.heartbeat.is_up, 400) is None, n
        assert_comes_up(one)
        one.signals.send()
        one.signals.send()
        assert one.run() == 0
        port.wrote()
        if countdown[0] > 0:
            break
        failed += 1
    assert 8 < failed < 99, "the test has run past the last call"


def test_a_dead_childs_last_words_still_count(scene, port):
    """The line is handed over and the first cause told in the same moment as the death is noticed."""

    def script(child: FakeChild) -> None:
        child.say(message_link.BORN, {"pid": 1})
        one.guardian.control.process = child  # as it is once this script is over
        one.guardian.control.read_messages()  # heard; what follows comes with the death
        child.say(message_link.LINE, {"safe_frame": SAFE_FRAME.hex(), "safe_reply": ""}, port.writer)
        child.say(message_link.FIRST_CAUSE, {"text": "internal error: ZeroDivisionError()"})
        child.dies(1)

    one = scene(script, lives(port))

    def death_first(descriptors: list[int], timeout_s: float) -> set[int]:
        """As poll may see it: the line was looked at a moment before its last words came."""
        ready = one.wait(descriptors, timeout_s)
        return {one.child.died} if one.child.died in ready else ready

    one.guardian.wait = death_first
    one.run(lambda: len(one.starter.started) == 2)
    assert port.wrote() == SAFE_FRAME
    assert "ZeroDivisionError" in one.said[0]
    assert Ending.from_json(one.starter.arguments[1]["restarted"]).cause is EndCause.DEFECT


@pytest.mark.parametrize(
    "nonsense",
    [
        b"r",
        b"r{}",
        b"r[1]",
        b"r{\xff",
        b"l{}",
        b'l{"safe_frame": "zz", "safe_reply": ""}',
        b"b{}",
        b"f{}",
        b'r{"info": 3, "banner": "", "stall_s": "soon", "watch": null}',
    ],
)
def test_a_control_process_that_talks_nonsense_is_replaced(scene, port, nonsense):
    def script(child: FakeChild) -> None:
        dies_after(8, port, None)(child)
        child.theirs.send(nonsense)

    one = scene(script, lives(port))
    assert one.run(lambda: len(one.starter.started) == 2) is None
    assert port.wrote() == SAFE_FRAME
    assert Ending.from_json(one.starter.arguments[1]["restarted"]).cause is EndCause.NONSENSE


def test_a_word_of_a_newer_version_is_passed_over(scene, port):
    def script(child: FakeChild) -> None:
        child.say("?", {"what": 1}, port.writer)
        dies_after(8, port, None)(child)

    assert_comes_up(scene(script))


def no_process(child: FakeChild) -> None:
    raise BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable")


def test_a_machine_without_a_process_for_us_is_asked_again_later(scene, port):
    one = scene(no_process, no_process, no_process, lives(port))
    assert_comes_up(one)
    assert one.now_s > 100.0, "not in a hurry"
    assert Ending.from_json(one.starter.arguments[3]["restarted"]).cause is EndCause.NOT_STARTED


def test_what_never_starts_ends_with_the_count_of_causes(scene, port):
    one = scene(no_process)
    assert one.run() == 1
    assert "A402 five restarts in 60 s (6 not-started)" in one.said[-1]


@pytest.mark.parametrize(
    ("code", "comes_up_first", "ends"),
    [
        (78, False, 78),
        (77, False, 77),
        (69, False, 69),
        (78, True, 78),
        (77, True, 77),
        (69, True, None),
        (1, False, None),
    ],
)
def test_only_a_refusal_with_a_sentence_is_an_end(scene, port, code, comes_up_first, ends):
    """A device that is away while control is started again (69) comes back; a configuration does not mend itself."""
    first = [dies_after(8, port)] if comes_up_first else []
    one = scene(*first, dies_after(3, port, code), lives(port))
    assert one.run(lambda: len(one.starter.started) == 2 + comes_up_first) == ends
    assert port.wrote().startswith(SAFE_FRAME)


def test_there_are_never_two_control_processes(scene, port):
    """One that was killed and does not go may still hold the port; the next one is started once it is gone."""

    def script(child: FakeChild) -> None:
        dies_after(8, port, None)(child)
        child.is_immortal = True

    one = scene(script, lives(port))
    one.run(lambda: len(one.said) == 2)
    assert port.wrote() == SAFE_FRAME
    assert "it does not go" in one.said[0]
    assert one.said[1].startswith("A410 the killed control process (pid 1000) does not go")
    assert one.guardian._patience_s() > 1e6
    one.now_s += 3600.0
    assert one.guardian._on_deadline() is None
    assert len(one.starter.started) == 1
    one.child.dies(-9)
    assert_comes_up(one)
    assert len(one.starter.started) == 2


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
        child.counters = FakeTurns(turns, letter)

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
    assert one.starter.calls[-1] == "rig prepared=False"
    assert len(one.starter.started) == 1, "control was left alone"


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


def test_a_reader_that_has_gone_does_not_end_the_guardian():
    """`run --json | head -1`, and a closed stderr: said to nobody, and exit 0."""
    reader, writer = os.pipe()
    os.close(reader)
    code = (
        "from gateway.service.supervisor.guardian_sentences import print_error, print_ready; print_ready('READY'); "
        "print_ready({}); print_error('A401')"
    )
    done = subprocess.run([sys.executable, "-c", code], stdout=writer, stderr=writer, check=False)
    os.close(writer)
    assert done.returncode == 0
