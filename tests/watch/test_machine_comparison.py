"""The watch with a reference, in virtual time on a machine that is not the twin: its nature raises nothing, a change its name.

The fast part looks with short windows and searches nothing; `--long` watches ten quiet minutes with windows as rigs have them,
and effects that are switched on.
"""

import json
import os
from dataclasses import replace
from math import sqrt
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.diagnosis.changes.machine_document import read_machine
from gateway.diagnosis.measurement import Measurement
from gateway.diagnosis.model_fit.base_fit import DEFAULT_PLANT
from gateway.registers.residual_cause import ResidualCause
from gateway.twin.plant import with_value
from gateway.watch import described_machine as room
from gateway.watch import machine_comparison
from gateway.watch.machine_comparison import MachineComparison
from gateway.watch.reference_recording import keep_reference_recording
from gateway.watch.residual_watch import Watch, WatchSettings
from gateway.watch.warning_filter import WindowVerdict
from gateway.watch.window import Window
from gateway.watch.window_verdict import EXCESS_WITHOUT_A_NAME
from tests.diagnosis.changes.foreign_rig import Wish
from tests.watch.foreign_course import CourseRing, recorded

LEAST_N = 0.1  # a quarter of a band of 0.4 N
EVERY_S = 20.0  # also after a search: it took 1.7 to 4.7 s of processor, and the watch may take a quarter of a core for a while
DESCRIBED = Path(__file__).with_name("described_reference.json")


class CountingComparison(MachineComparison):
    """Counts searches and answers none."""

    searches = 0

    def judge(self, window: Window) -> WindowVerdict:
        self.searches += 1
        return WindowVerdict()


def watch_of(ring: CourseRing, comparison: MachineComparison, window_s: float) -> Watch:
    return Watch(ring, comparison, WatchSettings(window_s, EVERY_S), lambda: ring.now_s)  # type: ignore[arg-type]


def reference_of(seed: int, lasts_s: float, state: Path) -> Measurement:
    kept = keep_reference_recording(state, recorded(Wish(seed=seed, duration_s=lasts_s), state / "recordings"))
    return room.reference_measurement(state, kept)


@pytest.mark.long
def test_a_machines_own_nature_is_never_searched_for_and_a_change_is(tmp_path):
    machine = read_machine(json.loads(DESCRIBED.read_text()), [reference_of(4103, 30.0, tmp_path)])
    comparison = CountingComparison(machine, "0001.fgr", DEFAULT_PLANT, LEAST_N)
    changed = Wish(seed=4003, effect="transport-delay", size=2.5, duration_s=150.0)
    ring = CourseRing(Wish(seed=4003, duration_s=150.0), changed, 100.0)
    watch = watch_of(ring, comparison, 20.0)
    searches = []
    for ring.now_s in (40.0, 60.0, 80.0, 100.0, 120.0, 140.0):
        watch.check_newest_window()
        assert watch.why_skipped == ""
        searches.append(comparison.searches)
    assert searches == [0, 0, 0, 0, 1, 2]
    assert watch.counters["floor_n"] < 0.11


def test_a_described_machine_is_kept_and_read_again(tmp_path, monkeypatch):
    kept = keep_reference_recording(tmp_path, recorded(Wish(seed=4103, duration_s=30.0), tmp_path / "recordings"))
    made = []

    def describe(old, plant, options):
        made.append(plant)
        return read_machine(json.loads(DESCRIBED.read_text()), old)

    monkeypatch.setattr(room, "describe_machine", describe)
    first = room.described_machine(tmp_path, kept, DEFAULT_PLANT)
    again = room.described_machine(tmp_path, kept, DEFAULT_PLANT)
    assert len(made) == 1 and again.parameters == first.parameters and again.error == first.error
    (tmp_path / "reference" / "machine.json").write_bytes(b"torn")
    room.described_machine(tmp_path, kept, DEFAULT_PLANT)
    assert len(made) == 2
    other = with_value(DEFAULT_PLANT, "friction", "coulomb_n", 7.0)
    room.described_machine(tmp_path, kept, other)
    assert made[2:] == [other], "what was described from another plant is another machine"
    room.described_machine(tmp_path, replace(kept, sha256="0" * 64), other)
    assert len(made) == 4, "and so is that of another recording of the same name"


def named_after_s(effect: str, size: float, tmp_path: Path) -> tuple[float, ResidualCause, str]:
    """Seconds from switching the effect on to a name; the watch with its search, windows of a minute."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    kept = keep_reference_recording(tmp_path, recorded(Wish(seed=4103, duration_s=70.0), tmp_path / "recordings"))
    machine = room.described_machine(tmp_path, kept, DEFAULT_PLANT)
    lasts_s, switched_s = 320.0, 170.0
    quiet = Wish(seed=4003, duration_s=lasts_s)
    ring = CourseRing(quiet, Wish(seed=4003, effect=effect, size=size, duration_s=lasts_s), switched_s)
    watch = watch_of(ring, MachineComparison(machine, kept.name, DEFAULT_PLANT, LEAST_N), 60.0)
    now_s = 90.0
    while now_s < lasts_s:
        ring.now_s = now_s
        watch.check_newest_window()
        if watch.published.cause is not ResidualCause.NONE:
            return now_s - switched_s, watch.published.cause, watch.published.sentence
        now_s += EVERY_S
    return lasts_s, ResidualCause.NONE, ""


@pytest.mark.long
@pytest.mark.parametrize("effect", ["leak", "transport-delay", "regulator-hysteresis", "creep"])
def test_an_effect_that_is_switched_on_is_named_within_two_minutes(effect, tmp_path):
    after_s, cause, sentence = named_after_s(effect, 4.0, tmp_path)
    assert cause.effect == effect, sentence
    assert after_s <= 120.0
    assert "differs from the reference 0001.fgr" in sentence


@pytest.mark.long
@pytest.mark.parametrize("seed", [4004, 4005])
def test_ten_quiet_minutes_have_no_name(seed, tmp_path):
    kept = keep_reference_recording(tmp_path, recorded(Wish(seed=4103, duration_s=70.0), tmp_path / "recordings"))
    machine = room.described_machine(tmp_path, kept, DEFAULT_PLANT)
    ring = CourseRing(Wish(seed=seed, duration_s=690.0))
    watch = watch_of(ring, MachineComparison(machine, kept.name, DEFAULT_PLANT, LEAST_N), 60.0)
    for look in range(30):
        ring.now_s = 90.0 + EVERY_S * look
        watch.check_newest_window()
        assert watch.published.cause is ResidualCause.NONE, watch.published.sentence
    assert watch.counters["skipped"] == 0


@pytest.mark.parametrize(
    ("excess_n", "told"),
    [
        (0.09, "nothing is off"),
        (0.11, "no verdict"),
        (0.99 * EXCESS_WITHOUT_A_NAME * 0.1, "no verdict"),
        (2.0, "unknown"),
    ],
)
def test_what_no_change_explains_is_told_only_where_it_is_much(
    excess_n: float, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In between a look neither accuses nor acquits: a warning that stands would be cleared by it."""
    left_n, least_n = 0.3, 0.1
    found = SimpleNamespace(causes=(), baseline=SimpleNamespace(rms_n=sqrt(left_n**2 + excess_n**2)))
    monkeypatch.setattr(machine_comparison, "compare_with_machine", lambda *_: found)
    monkeypatch.setattr(machine_comparison, "describe_leftover", lambda _: "drifts")
    machine: Any = SimpleNamespace(error=SimpleNamespace(left_n=left_n))
    plant: Any = None
    window: Any = SimpleNamespace(measurement=None, excitation_v=1.0)
    verdict = MachineComparison(machine, "0003.fgr", plant, least_n).judge(window)
    if told == "no verdict":
        assert verdict is None
    else:
        assert verdict is not None
        assert (verdict.cause is ResidualCause.UNKNOWN) == (told == "unknown")
        assert verdict.excitation_v == 1.0
