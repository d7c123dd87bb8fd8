"""The loop of the watch's process, in virtual time: when it makes its comparison anew, and what it tells when."""

from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.registers.residual_cause import ResidualCause
from gateway.watch import watch_process
from gateway.watch.force_watch import PlantSince
from gateway.watch.warning_filter import WindowVerdict

WINDOW_S, EVERY_S = 60.0, 20.0
END_S = 900.0


class WatchedLongEnoughError(Exception):
    """It has been watched for long enough."""


class Scene:
    """The watch's surroundings: control that answers as `answer` says, and what happened: (time, what)."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self.answer: Callable[[float], dict[str, Any]] = lambda now_s: {"plant": 0, "plant_since_s": 0.0}
        self.reference: Callable[[float], str | None] = lambda now_s: None
        self.worse: Callable[[float], str] = lambda now_s: ""
        self.happened: list[tuple[float, str]] = []
        self.followed: list[PlantSince] = []
        self.forces: list[int] = []
        self.made = 0

    def sleep(self, duration_s: float) -> None:
        self.now_s += duration_s
        if self.now_s > END_S:
            raise WatchedLongEnoughError

    def note(self, what: str) -> None:
        self.happened.append((self.now_s, what))

    def hear(self, state: Path, message: dict[str, Any]) -> dict[str, Any]:
        if message:
            self.note(
                f"tells {message['worse'] or 'nothing'}" if message["counters"] else f"at once {message['worse']}"
            )
        return self.answer(self.now_s)

    def make(self, ring: Any, options: dict[str, Any]) -> tuple[Any, Any]:
        self.note("make")
        self.made += 1
        number = self.made
        published = WindowVerdict(ResidualCause.NONE, "")
        watch = SimpleNamespace(
            counters={}, published=published, why_skipped="", check_newest_window=lambda: self.note(f"look {number}")
        )
        force = SimpleNamespace(sentence="", follow=self.followed.append)
        force.look = lambda rows, columns: self.look_at_force(force, number)
        return watch, force

    def look_at_force(self, force: Any, number: int) -> None:
        self.forces.append(number)
        force.sentence = self.worse(self.now_s)

    def times_s(self, what: str) -> list[float]:
        return [at_s for at_s, happened in self.happened if happened == what]


@pytest.fixture
def scene(monkeypatch: pytest.MonkeyPatch) -> Scene:
    scene = Scene()
    clock = SimpleNamespace(
        sleep=scene.sleep, monotonic=lambda: scene.now_s, time=lambda: scene.now_s, process_time=lambda: 0.0
    )
    ring = SimpleNamespace(newest=lambda count: b"", columns=())
    for name, stand_in in {
        "time": clock,
        "make_watch": scene.make,
        "report_to_control": scene.hear,
        "work_gently": nullcontext,
        "resident_mb": lambda: 1.0,
    }.items():
        monkeypatch.setattr(watch_process, name, stand_in)
    monkeypatch.setattr("gateway.recording.ring.RingReader", lambda descriptor: ring)
    room = "gateway.watch.reference_recording"
    monkeypatch.setattr(f"{room}.read_reference_recording", lambda state: scene.reference(scene.now_s))
    monkeypatch.setattr(f"{room}.FirstGoodRecording", lambda state: SimpleNamespace(keep=lambda now_s: None))
    return scene


def watch(scene: Scene) -> None:
    with pytest.raises(WatchedLongEnoughError):
        watch_process.watch_forever({"ring": 0, "state": "", "window_s": WINDOW_S, "every_s": EVERY_S})


def test_it_begins_when_there_is_a_window_and_looks_again_and_again(scene: Scene) -> None:
    watch(scene)
    assert scene.times_s("make") == [WINDOW_S]
    assert scene.times_s("look 1") == scene.times_s("tells nothing") == [60.0 + 20.0 * k for k in range(43)]


def test_a_control_that_does_not_answer_for_a_while_changes_nothing(scene: Scene) -> None:
    scene.answer = lambda now_s: {} if 100.0 < now_s < 300.0 or now_s < 90.0 else {"plant": 3, "plant_since_s": 10.0}
    watch(scene)
    assert scene.times_s("make") == [WINDOW_S]
    assert scene.followed == [PlantSince(3, 10.0)]
    assert len(scene.times_s("look 1")) == 43


def test_another_plant_is_compared_with_once_its_own_rows_fill_a_window(scene: Scene) -> None:
    """Rows of before were commanded by another one."""
    changed_s = 205.0
    scene.answer = lambda now_s: (
        {"plant": 4, "plant_since_s": changed_s} if now_s >= changed_s else {"plant": 0, "plant_since_s": 0.0}
    )
    watch(scene)
    assert scene.times_s("make") == [WINDOW_S, changed_s + WINDOW_S]
    assert scene.followed == [PlantSince(0, 0.0), PlantSince(4, changed_s)]
    assert max(scene.times_s("look 1")) < changed_s < min(scene.times_s("look 2"))


def test_a_plant_that_has_been_in_use_for_a_window_is_compared_with_at_once(scene: Scene) -> None:
    """As where control did not answer for longer than that."""
    scene.answer = lambda now_s: {} if 100.0 < now_s < 300.0 else {"plant": int(now_s > 100.0), "plant_since_s": 101.0}
    watch(scene)
    assert scene.times_s("make") == [WINDOW_S, 300.0]


def test_another_reference_is_compared_with_from_the_next_look_on(scene: Scene) -> None:
    scene.reference = lambda now_s: "morning" if now_s >= 130.0 else None
    watch(scene)
    assert scene.times_s("make") == [WINDOW_S, 140.0]
    assert scene.times_s("look 2")[0] == 140.0
    assert set(scene.forces) == {1}, "the force is watched as before"


def test_a_force_that_is_worse_is_told_before_the_long_search_and_its_end_too(scene: Scene) -> None:
    scene.worse = lambda now_s: "worse" if 150.0 < now_s < 250.0 else ""
    watch(scene)
    order = [what for at_s, what in scene.happened if at_s == 160.0]
    assert order == ["at once worse", "look 1", "tells worse"]
    assert scene.times_s("at once worse") == [160.0]
    assert scene.times_s("at once ") == [260.0]


def test_each_look_also_looks_for_a_first_good_recording_and_a_full_disk_stops_nothing(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = list[float]()

    def keep(now_s: float) -> None:
        asked.append(now_s)
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(
        "gateway.watch.reference_recording.FirstGoodRecording", lambda state: SimpleNamespace(keep=keep)
    )
    watch(scene)
    assert asked == scene.times_s("look 1")
