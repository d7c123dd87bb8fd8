"""Each law of who attempts upon a gateway is broken by a made history at least once, without a process, and complained of."""

import http.client
import json
import subprocess
from collections.abc import Callable, Iterable
from pathlib import Path
from random import Random
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.profiles import load_register_map
from tests.end_to_end.attempts import attempted_gateway, rough, test_drawn_attempts
from tests.end_to_end.attempts.attempted_gateway import ENABLED, FORCE, IN_BAND, Attempted, Look

MAP = load_register_map("force-v1")
HELD = (ENABLED | IN_BAND, 5, FORCE, *[0] * 21)


class Time:
    """Goes on by what is waited for alone."""

    def __init__(self) -> None:
        self.now_s = 100.0
        self.is_ended = False

    def monotonic(self) -> float:
        return self.now_s

    def wait(self, seconds: float) -> bool:
        self.now_s += max(seconds, 0.001)
        return False

    def is_set(self) -> bool:
        return self.is_ended

    def set(self) -> None:
        self.is_ended = True


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Time:
    clock = Time()
    for module in (attempted_gateway, test_drawn_attempts, rough):
        monkeypatch.setattr(module, "time", clock)
    return clock


def answers(monkeypatch: pytest.MonkeyPatch, code: int, text: str = "") -> None:
    """Every verb ends so."""
    done = subprocess.CompletedProcess([], code, stdout=text, stderr="")
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: done)


@pytest.fixture
def scene(clock: Time, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Attempted:
    """One whose gateway is only what is told here, and whose verbs end well."""
    answers(monkeypatch, 0, "done")
    process = SimpleNamespace(poll=lambda: None, pid=-1)
    log = tmp_path / "log"
    log.write_text("")
    gateway: Any = SimpleNamespace(process=process, state=tmp_path, port=1, log=log, ready={"web": ["127.0.0.1", 1]})
    scene = Attempted(gateway, tmp_path / "cell.yaml", Random(1))
    scene.is_over = clock  # type: ignore[assignment]
    return scene


def looks(scene: Attempted, clock: Time, *, every_s: float = 0.03, words: tuple[int, ...] = HELD) -> Iterable[Any]:
    """Two seconds of acts, beside each of which somebody has looked on."""

    def act(_: Attempted) -> None:
        scene.looks.append(Look(clock.now_s + 0.001, 0.002, words))
        clock.now_s += every_s

    return [act] * round(2.0 / every_s)


def changed(index: int, word: int) -> tuple[int, ...]:
    return (*HELD[:index], word, *HELD[index + 1 :])


def test_a_force_that_is_held_breaks_no_law(scene: Attempted, clock: Time) -> None:
    test_drawn_attempts.hold_beside(scene, looks(scene, clock))
    assert Look(0.0, 0.0, HELD).holds()
    assert len(scene.looks) > 60
    assert scene.faults == []


@pytest.mark.parametrize(
    ("name", "word"),
    [("status_word", IN_BAND), ("fault_code", 3), ("force_measured", FORCE + 250), ("force_measured", FORCE - 250)],
)
def test_a_force_that_is_lost_once_is_seen(scene: Attempted, clock: Time, name: str, word: int) -> None:
    """By the word of the map's own name: one that is not where the judge looks says nothing."""
    index = MAP.find(name).address - 100
    acts = [*looks(scene, clock), *looks(scene, clock, every_s=1.9, words=changed(index, word)), *looks(scene, clock)]
    with pytest.raises(AssertionError, match=r"of \d+ looks"):
        test_drawn_attempts.hold_beside(scene, acts)


@pytest.mark.parametrize("when", ["at the begin", "meanwhile", "at the end", "always"])
def test_a_gateway_that_answers_nothing_for_a_second_is_seen(scene: Attempted, clock: Time, when: str) -> None:
    def say_nothing(_: Attempted) -> None:
        clock.now_s += 1.1

    answered, silent = looks(scene, clock), [say_nothing]
    acts = {
        "at the begin": [*silent, *answered],
        "meanwhile": [*answered, *silent, *answered],
        "at the end": [*answered, *silent],
        "always": silent,
    }
    with pytest.raises(AssertionError):
        test_drawn_attempts.hold_beside(scene, acts[when])


def test_a_force_that_does_not_come_is_seen(scene: Attempted, monkeypatch: pytest.MonkeyPatch) -> None:
    master = SimpleNamespace(
        write_registers=lambda *_, **__: SimpleNamespace(isError=lambda: False), close=lambda: None
    )
    monkeypatch.setattr(attempted_gateway, "client", lambda _: master)
    scene.looks.append(Look(0.0, 0.0, HELD))  # of before: it says nothing of what is asked now
    with pytest.raises(AssertionError, match="no force within"):
        attempted_gateway.take_up(scene, 5.0)


@pytest.mark.parametrize(
    ("code", "text"),
    [(-11, "said"), (1, ""), (1, " \n"), *((0, f"x {word} x") for word in attempted_gateway.DEFECTS)],
)
def test_a_verb_that_breaks_or_is_silent_is_a_fault(
    scene: Attempted, monkeypatch: pytest.MonkeyPatch, code: int, text: str
) -> None:
    answers(monkeypatch, code, text)
    scene.verb("audit", "show")
    assert len(scene.faults) == 1


@pytest.mark.parametrize(("code", "text"), [(0, ""), (1, "A204 no"), (2, "usage: x")])
def test_a_verb_may_refuse(scene: Attempted, monkeypatch: pytest.MonkeyPatch, code: int, text: str) -> None:
    answers(monkeypatch, code, text)
    scene.verb("audit", "show")
    assert scene.faults == []


@pytest.mark.parametrize(("status", "faults"), [(500, 1), (200, 0), (403, 0), (404, 0), (503, 0)])
@pytest.mark.parametrize("method", ["GET", "POST"])
def test_a_page_may_refuse_but_have_no_defect(
    scene: Attempted, monkeypatch: pytest.MonkeyPatch, method: str, status: int, faults: int
) -> None:
    answer = SimpleNamespace(status=status, read=lambda: json.dumps({"csrf": "t"}), getheader=lambda _: "id=1; x")
    page = SimpleNamespace(request=lambda *_: None, getresponse=lambda: answer, close=lambda: None)
    monkeypatch.setattr(http.client, "HTTPConnection", lambda *_, **__: page)
    attempted_gateway.ask_http(scene, method, "/", "{}")
    assert len(scene.faults) == faults


def test_a_gateway_that_ends_under_rough_acts_is_seen(scene: Attempted, monkeypatch: pytest.MonkeyPatch) -> None:
    def end(_: Attempted) -> None:
        scene.gateway.process = SimpleNamespace(poll=lambda: 1, pid=-1)  # type: ignore[assignment]

    monkeypatch.setattr(rough, "ACTS", (end,))
    with pytest.raises(AssertionError, match="it ended"):
        test_drawn_attempts.be_rough(scene, 5.0)


def test_a_rig_that_does_not_answer_is_a_fault(scene: Attempted, monkeypatch: pytest.MonkeyPatch) -> None:
    answers(monkeypatch, 1, "the simulated rig does not answer")
    rough.heal(scene)
    assert scene.faults == ["the simulated rig does not answer"]


def test_a_run_that_is_cut_may_say_no_defect(scene: Attempted, monkeypatch: pytest.MonkeyPatch) -> None:
    run = SimpleNamespace(
        wait=lambda _: None,
        send_signal=lambda _: None,
        communicate=lambda **_: ("Traceback (most recent call last)", ""),
    )
    monkeypatch.setattr(rough, "client", lambda _: SimpleNamespace(close=lambda: None))
    monkeypatch.setattr(rough, "write", lambda *_: True)
    monkeypatch.setattr(subprocess, "Popen", lambda *_, **__: run)
    rough.cut_run(scene)
    assert len(scene.faults) == 1


def played(scene: Attempted, monkeypatch: pytest.MonkeyPatch, folder: Path, code: int) -> None:
    """A scene in which nothing is done, of a gateway that ends with this code."""
    monkeypatch.setattr(attempted_gateway, "start", lambda *_, **__: scene.gateway)
    monkeypatch.setattr(attempted_gateway, "stop", lambda _: code)
    for act in ("_look_on", "_beat", "wake"):
        monkeypatch.setattr(attempted_gateway, act, lambda _: None)
    with attempted_gateway.attempted(folder, Random(1)):
        pass


def a_code(scene: Attempted, _: pytest.MonkeyPatch) -> int:
    return 1


def a_traceback(scene: Attempted, _: pytest.MonkeyPatch) -> int:
    scene.gateway.log.write_text("x\nTask exception was never retrieved\n")
    return 0


def a_record_that_does_not_hold(_: Attempted, monkeypatch: pytest.MonkeyPatch) -> int:
    answers(monkeypatch, 1, "line 3 is not what was written")
    return 0


@pytest.mark.parametrize("ill", [a_code, a_traceback, a_record_that_does_not_hold])
def test_what_a_gateway_leaves_at_its_end_is_judged(
    scene: Attempted,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    ill: Callable[[Attempted, pytest.MonkeyPatch], int],
) -> None:
    played(scene, monkeypatch, tmp_path, 0)
    code = ill(scene, monkeypatch)
    with pytest.raises(AssertionError):
        played(scene, monkeypatch, tmp_path, code)
