"""The guardian outlives every child, whenever and however it dies, and puts the safe voltage on the wire if there is a wire."""

import errno
import os

import pytest

from gateway.processes import message_link
from gateway.processes.exit_cause import EndCause, Ending
from tests.service.supervisor.guarded import (
    SAFE_FRAME,
    FakeChild,
    port,
)
from tests.service.supervisor.scripted_children import (
    assert_comes_up,
    dies_after,
    lives,
    rig_lives,
    scene,
)

__all__ = ["port", "scene"]


@pytest.mark.sampled
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
        assert "SIGKILL" in line if code in (-9, None) else f"exit {code}" in line
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
        child.say(message_link.LINE, {"safe_frame": SAFE_FRAME.hex(), "safe_reply": "", "reply_end": ""}, port.writer)
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
        b'l{"safe_frame": "zz", "safe_reply": "", "reply_end": ""}',
        b"b{}",
        b"f{}",
        b'r{"info": 3, "banner": "", "stall_s": "soon", "optional": {}}',
        b'r{"info": {"modbus": null}, "banner": "", "stall_s": 0.1, "optional": []}',
        b'r{"info": {"modbus": null}, "banner": "", "stall_s": 0.1, "optional": {}, "listening": [1]}',
        b'r{"info": {"modbus": null}, "banner": "", "stall_s": NaN, "optional": {}}',
        b'r{"info": {"modbus": null}, "banner": "", "stall_s": 1e999, "optional": {}}',
        b'r{"info": {"modbus": null}, "banner": "", "stall_s": 0, "optional": {}}',
        b'r{"info": {"modbus": null}, "banner": "", "stall_s": -0.1, "optional": {}}',
        b'b{"pid": 1e999}',
        b"c" + b'{"a":' * 20_000 + b"1" + b"}" * 20_000,  # Python 3.13 reads a few thousand
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


@pytest.mark.parametrize("nonsense", [{"safe_frame": "zz"}, {"form": b"(".hex()}, {"reply_timeout_s": "soon"}])
def test_a_port_that_comes_with_nonsense_is_not_kept(scene, port, nonsense):
    """Who keeps it open keeps its lock, too, and no other control process could open it. What is no expression is found then,
    and not by the guardian's last write."""

    def script(child: FakeChild) -> None:
        dies_after(8, port, None)(child)
        handed = {"safe_frame": SAFE_FRAME.hex(), "safe_reply": "", "reply_end": ""}
        child.say(message_link.LINE, handed | nonsense, port.writer)

    one = scene(script, lives(port))
    assert one.run(lambda: len(one.starter.started) == 2) is None
    assert port.wrote() == SAFE_FRAME
    assert Ending.from_json(one.starter.arguments[1]["restarted"]).cause is EndCause.NONSENSE
    assert_comes_up(one)  # and the scene counts descriptors


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
    assert "Resource temporarily unavailable: raise how many processes" in one.said[0]


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


def test_a_cause_is_that_of_one_death_and_not_of_the_next(scene, port):
    def fails(child: FakeChild) -> None:
        dies_after(8, port, None)(child)
        child.say(message_link.FIRST_CAUSE, {"text": "internal error: ZeroDivisionError()"})
        child.dies(1)

    one = scene(fails, dies_after(8, port, -9), lives(port))
    one.run(lambda: len(one.starter.started) == 3)
    causes = [Ending.from_json(arguments["restarted"]).cause for arguments in one.starter.arguments[1:]]
    assert causes == [EndCause.DEFECT, EndCause.DIED]


def test_what_had_come_up_is_started_again_at_once_each_time(scene, port):
    one = scene(*[dies_after(8, port, -9)] * 4, lives(port))
    began_s = one.now_s
    one.run(lambda: len(one.starter.started) == 5)
    assert one.now_s == began_s
    binds = [arguments["bind"] for arguments in one.starter.arguments]
    assert binds == [None, *[("127.0.0.1", 5020)] * 4], "masters know the port"


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
