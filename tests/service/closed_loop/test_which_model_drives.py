"""Which model a study lets drive, and what it compares, with identification and runs played."""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.control import NO_COMPENSATION
from gateway.control.compensation.cell_map import CellMap
from gateway.control.compensation.command_map import CommandMap
from gateway.profiles import load_plant, load_rig
from gateway.profiles.rigs.compensated_effects import CALIBRATE
from gateway.service.closed_loop import study
from gateway.service.closed_loop.identified_model import remove_compensated
from gateway.service.closed_loop.simulated_run import ControlSetup, SimulatedRun
from gateway.twin.plant import with_value

BASE = load_plant("paper-slide").plant
EXTENDED = with_value(BASE, "friction", "coulomb_n", 3.0)
DEMO = load_rig("demo")


def model(reach_n: float, name: str) -> Any:
    return SimpleNamespace(force_range_n=(0.0, reach_n), name=name)


class Played:
    """off_n: of a run with each model, by its name; runs: who drove, with which seed and how far."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, new: Any) -> None:
        self.old, self.new = model(80.0, "old"), new
        self.off_n = {"old": 2.0, "new": 1.0}
        self.runs: list[tuple[str, int, float]] = []
        self.tops_v: list[float] = []
        patch = partial(monkeypatch.setattr, study)
        patch("identify_model", self._identify)
        patch("compensation_of", self._compensation)
        patch("remove_compensated", lambda plant, compensation: plant)
        patch("draw_schedule", lambda base, extended, seed, most_n: (seed, most_n))
        patch("simulate_run", self._run)

    def _identify(self, plant: object, top_v: float) -> Any:
        self.tops_v.append(top_v)
        if plant == BASE:
            return self.old
        if isinstance(self.new, Exception):
            raise self.new
        return self.new

    def _compensation(self, *_: object, new_model: bool) -> Any:
        acts = ("friction",) if new_model else ()
        limited = (("leak", "no input"),) if new_model else (("friction", CALIBRATE), ("leak", "no input"))
        return replace(NO_COMPENSATION, acts=acts, limited=limited)

    def _run(self, driver: ControlSetup, plant: object, wishes: Any, seed: int, inputs: object) -> SimulatedRun:
        name = driver.model.name
        self.runs.append((name, *wishes))
        assert plant == EXTENDED and wishes[0] == seed
        off_n: Any = [self.off_n[name], -self.off_n[name]]
        return SimulatedRun(study.np.array(off_n), (0.1,), "")

    def gain(self, base: Any = BASE, extended: Any = EXTENDED) -> study.ClosedLoopGain:
        return study.closed_loop_gain(base, extended, DEMO, seeds=[3, 4], inputs=())


LEAST_N = min(DEMO.control.limits.force_max_n, 0.92 * 80.0)


@pytest.mark.parametrize("off_n", [1.0, 2.0])
def test_a_model_that_does_no_worse_on_a_run_of_its_own_drives_afterwards(
    monkeypatch: pytest.MonkeyPatch, off_n: float
) -> None:
    played = Played(monkeypatch, model(80.0, "new"))
    played.off_n["new"] = off_n
    gain = played.gain()
    assert played.runs[:2] == [("old", 10_003, LEAST_N), ("new", 10_003, LEAST_N)], "a seed that is not judged"
    assert played.runs[2:] == [(name, seed, LEAST_N) for name in ("old", "new") for seed in (3, 4)]
    assert (gain.before_rms_n, gain.after_rms_n) == (2.0, off_n) and gain.compensated == ("friction",)
    assert gain.notes == ("the model was identified anew on the extended plant",)
    assert played.tops_v == [pytest.approx(0.94 * DEMO.control.limits.voltage_max_v)] * 2


@pytest.mark.parametrize(
    ("new", "why"),
    [
        (model(80.0, "new"), "a model identified on the extended plant does no better"),
        (ValueError("too wide"), "the extended plant gives no model: too wide"),
    ],
)
def test_a_model_that_does_worse_or_is_none_is_left_out_with_its_reason(
    monkeypatch: pytest.MonkeyPatch, new: Any, why: str
) -> None:
    """What no model could compensate keeps the reason that it has."""
    played = Played(monkeypatch, new)
    played.off_n["new"] = 2.1
    gain = played.gain()
    assert gain.not_compensated == (("friction", why), ("leak", "no input")) and gain.notes == ()
    assert {name for name, seed, _ in played.runs if seed < 10_000} == {"old"}


def test_a_model_that_is_the_same_needs_no_trial(monkeypatch: pytest.MonkeyPatch) -> None:
    played = Played(monkeypatch, None)
    played.new = played.old
    gain = played.gain()
    assert [seed for _, seed, _ in played.runs] == [3, 4, 3, 4] and gain.compensated == ("friction",)


def test_of_what_control_compensates_the_model_knows_nothing() -> None:
    """It would be made good twice."""
    bent = with_value(with_value(EXTENDED, "regulator", "command_bow", 0.05), "regulator", "command_s", 0.02)
    bent = with_value(bent, "cell", "crosstalk_n_per_v", 0.1)
    cell, command = CellMap(crosstalk_n_per_v=0.1), CommandMap(bow=0.05, s=0.02)
    assert remove_compensated(bent, NO_COMPENSATION) == bent
    assert remove_compensated(bent, replace(NO_COMPENSATION, cell=cell, command=command)) == EXTENDED


def test_nothing_to_know_is_run_once(monkeypatch: pytest.MonkeyPatch) -> None:
    played = Played(monkeypatch, None)
    played.new = played.old
    gain = played.gain(base=EXTENDED)
    assert [seed for _, seed, _ in played.runs] == [3, 4] and gain.rms_ratio == 1.0


@pytest.mark.parametrize(("old_n", "new_n", "is_told"), [(80.0, 80.0, False), (80.0, 20.0, True), (20.0, 80.0, True)])
def test_a_schedule_that_cannot_go_all_the_way_says_so(
    monkeypatch: pytest.MonkeyPatch, old_n: float, new_n: float, is_told: bool
) -> None:
    """Both runs of a pair go as far as the lesser model, in the trial as well."""
    played = Played(monkeypatch, model(new_n, "new"))
    played.old = model(old_n, "old")
    gain = played.gain()
    assert any("the schedule goes up to 18.4 N" in note for note in gain.notes) is is_told
    assert [most_n for _, _, most_n in played.runs] == pytest.approx([18.4 if is_told else LEAST_N] * 6)
