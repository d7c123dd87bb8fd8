"""Clean recordings of the gateway's own, of every kind that a first day brings, give no name, and the watch stays silent.

Made in virtual time by tests/watch/clean_runs.py: the whole wired gateway, late wake-ups, 9600 baud. The push gate asks
for few and short ones; --long for all kinds.
"""

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gateway.cli.diagnosis.inputs import Sources, read_sources
from gateway.diagnosis import Diagnosis, Options, Verdict, diagnose
from gateway.diagnosis.bench.bench import bench_of
from gateway.diagnosis.model_fit.initial_state import fit_initial_states
from gateway.profiles import load_rig
from gateway.recording import read_recording
from gateway.recording.export import export_csv
from gateway.registers.residual_cause import ResidualCause
from gateway.service.running_rig.recording.recorded_row import COLUMNS
from gateway.twin.plant import with_value
from gateway.watch.plant_comparison import PlantComparison
from gateway.watch.reference import WatchReference
from gateway.watch.residual_watch import Watch, WatchSettings
from gateway.watch.watch_process import diagnose_window
from tests.watch.clean_runs import KINDS, recorded, rows_of

NOISE_N = 0.12  # of the demo rig's cell


def read(kind: str, seed: int, directory: Path, lasts_s: float) -> Sources:
    return read_sources([str(recorded(kind, seed, directory, lasts_s))], rig=None, columns=None, state=None)


def answer(sources: Sources) -> Diagnosis:
    options = Options(late_s=sources.late_s, quantum_n=sources.quantum_n, is_own=sources.is_own)
    return diagnose(sources.measurements, sources.plant.plant, options)


def assert_nothing_is_named(found: Diagnosis) -> None:
    assert found.causes == (), [(cause.name, cause.gain) for cause in found.causes]
    assert found.suspects == ()
    assert found.verdict is Verdict.NOTHING_FOUND, found.leftover
    assert found.baseline.rms_n < 1.2 * NOISE_N


@pytest.mark.sampled
@pytest.mark.parametrize("kind", ["from a hold", "taps"])
def test_a_recording_that_begins_in_the_middle_of_work_gives_no_name(tmp_path: Path, kind: str) -> None:
    """Before, they gave `warm-up or presliding` and `regulator-hysteresis`."""
    assert_nothing_is_named(answer(read(kind, 1, tmp_path, 20.0)))


@pytest.mark.long
def test_half_of_a_clean_recording_has_no_drift(tmp_path: Path) -> None:
    """The base model had found half of the friction, and a drift of 0.02 N in all moved it to the other half: that gain was
    the drift's, with 93 %. Six seconds: the whole run is played, for its beginning belongs to it."""
    (whole,) = read("from a hold", 1, tmp_path, 70.0).paths
    recording = read_recording(whole)
    later = recording.columns["time_s"] - recording.columns["time_s"][0] >= 35.0
    half = {name: values[later] for name, values in recording.columns.items()}
    export_csv(replace(recording, columns=half, rows=int(later.sum())), tmp_path / "half.csv")
    found = answer(read_sources([str(tmp_path / "half.csv")], rig=None, columns=None, state=None))
    assert_nothing_is_named(found)
    assert found.base.friction.coulomb_n == pytest.approx(1.0, abs=0.1)


@pytest.mark.sampled
@pytest.mark.parametrize("kind", ["from wiggles", "from a fall", "sine"])
def test_what_was_sent_and_the_start_leave_the_cell_s_noise_only(tmp_path: Path, kind: str) -> None:
    """By the rig's own plant, with nothing fitted but the start and what the wires take."""
    sources = read(kind, 3, tmp_path, 15.0)
    plant = with_value(with_value(sources.plant.plant, "cell", "noise_n", 0.0), "cell", "clock_offset_s", 0.011)
    bench = bench_of(sources.measurements)
    assert bench.rms_n(fit_initial_states(bench, plant).residual_n) < 1.2 * NOISE_N


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("kind", KINDS)
def test_no_kind_of_clean_recording_gives_a_name(tmp_path: Path, kind: str, seed: int) -> None:
    assert_nothing_is_named(answer(read(kind, seed, tmp_path, 70.0)))


@pytest.mark.long
def test_a_setting_that_nobody_recorded_is_no_jump_of_the_gain(tmp_path: Path) -> None:
    """At 69.21 s the loop wakes late, and the 0 V of a fall's lead are in no row: before, 0.16 N and a verdict `unknown`."""
    assert_nothing_is_named(answer(read("stairs", 5, tmp_path, 70.0)))


class Ring:
    """What the watch reads: the rows up to a moment."""

    columns = COLUMNS

    def __init__(self, rows: Sequence[tuple[float, ...]]) -> None:
        self._rows = np.array(rows)
        self.now_s = 0.0

    @property
    def last_s(self) -> float:
        return float(self._rows[-1, 0])

    def newest(self, count: int) -> bytes:
        return bytes(self._rows[self._rows[:, 0] <= self.now_s].tobytes())


def watched(kind: str, seed: int, lasts_s: float, window_s: float) -> tuple[list[ResidualCause], Watch]:
    """What is published after each look, a look every half a window."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    ring, plant = Ring(rows_of(kind, seed, lasts_s)), load_rig("demo").plant
    assert plant is not None
    watch = Watch(
        ring,
        PlantComparison(WatchReference(plant), diagnose_window, 0.25),
        WatchSettings(window_s, 0.5 * window_s),
        lambda: ring.now_s,
    )  # type: ignore[arg-type]
    stood = []
    for now_s in np.arange(1.3 * window_s, ring.last_s, 0.5 * window_s):
        ring.now_s = now_s
        watch.check_newest_window()
        stood.append(watch.published.cause)
    return stood, watch


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_the_watch_says_nothing_of_any_kind_of_clean_work(kind: str) -> None:
    """tests/watch/test_watch_in_virtual_time.py asks the same, with a stub for the search, in the push gate."""
    stood, watch = watched(kind, 5, 190.0, 60.0)
    assert set(stood) <= {ResidualCause.NONE}, watch.published
