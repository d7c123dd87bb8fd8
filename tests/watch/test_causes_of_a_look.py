"""Which of what a search has found is told: the change that does most to the force, under a name that can be, if it matters."""

from math import hypot, isclose
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from gateway.diagnosis import Diagnosis
from gateway.diagnosis.result import Cause, Estimate, Gain, Leftover
from gateway.registers.residual_cause import ResidualCause
from gateway.twin.plant import Friction, Plant
from gateway.watch import machine_comparison, plant_comparison, window_verdict
from gateway.watch.machine_comparison import MachineComparison
from gateway.watch.plant_comparison import PlantComparison
from gateway.watch.reference import WatchReference
from gateway.watch.warning_filter import WindowVerdict
from gateway.watch.window_verdict import PlantChange, describe_leftover, excess_of, judge_window, plausible_name

LEFT_N, LEAST_N = 0.3, 0.1


def saving(name: str, saved_n: float, *others: str) -> Cause:
    """A cause that takes so much out of what the machine leaves."""
    gain = Gain(hypot(LEFT_N, saved_n), LEFT_N, (0.0, 1.0), 0.5)
    value: Any = SimpleNamespace(section="friction", value=2.4, unit="N")
    parameters: dict[str, Estimate] = {"coulomb_n": value}
    return Cause(name, (name, *others), 0.9, parameters, gain)


def judged(monkeypatch: pytest.MonkeyPatch, *causes: Cause, rms_n: float = 1.0) -> Any:
    base = SimpleNamespace(friction=SimpleNamespace(coulomb_n=1.0))
    found = SimpleNamespace(causes=causes, base=base, baseline=SimpleNamespace(rms_n=rms_n), suspects=(), leftover=())
    monkeypatch.setattr(machine_comparison, "compare_with_machine", lambda *_: found)
    machine: Any = SimpleNamespace(error=SimpleNamespace(left_n=LEFT_N))
    window: Any = SimpleNamespace(measurement=None, excitation_v=1.0)
    plant: Any = None
    return MachineComparison(machine, "0003.fgr", plant, LEAST_N).judge(window)


def test_of_several_changes_the_one_that_does_most_to_the_force_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    verdict = judged(monkeypatch, saving("leak", 0.2), saving("coulomb-friction", 0.5), saving("creep", 0.3))
    assert verdict.cause is ResidualCause.COULOMB_FRICTION
    assert verdict.sentence == (
        "the force differs from the reference 0003.fgr by 0.50 N (rms): coulomb-friction, coulomb_n 1 -> 2.4 N"
    )


def test_what_a_look_cannot_tell_from_the_cause_is_told_with_it(monkeypatch: pytest.MonkeyPatch) -> None:
    verdict = judged(monkeypatch, saving("leak", 0.5, "creep", "warm-up"))
    assert verdict.sentence.endswith("; this run cannot tell it from creep, warm-up")
    assert verdict.others == ("leak", "creep", "warm-up")


def test_a_change_that_disturbs_nobody_gives_no_name_to_a_force_that_is_off(monkeypatch: pytest.MonkeyPatch) -> None:
    verdict = judged(monkeypatch, saving("leak", 0.9 * LEAST_N), rms_n=1.0)
    assert verdict.cause is ResidualCause.UNKNOWN
    assert "nothing of the catalogue explains it" in verdict.sentence
    assert judged(monkeypatch, saving("leak", 0.9 * LEAST_N), rms_n=LEFT_N).cause is ResidualCause.NONE


def test_a_fit_that_is_worse_in_rows_it_did_not_see_saves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    worse = Cause("leak", ("leak",), 0.9, {}, Gain(LEFT_N, 2.0 * LEFT_N, (0.0, 1.0), 0.5))
    assert judged(monkeypatch, worse, rms_n=LEFT_N).cause is ResidualCause.NONE


@pytest.mark.parametrize(
    ("name", "group", "published"),
    [
        ("clock-offset", ("clock-offset", "transport-delay"), "transport-delay"),
        ("clock-offset", ("clock-offset", "clock-skew"), "clock-offset"),
        ("clock-skew", ("clock-skew",), "clock-skew"),
        ("extra-lag", ("extra-lag", "transport-delay"), "extra-lag"),
        ("leak", ("creep", "leak"), "leak"),
    ],
)
def test_a_late_reading_is_a_late_machine_for_one_clock_stamps_both(
    name: str, group: tuple[str, ...], published: str
) -> None:
    assert plausible_name(name, group) == published


def test_what_is_left_is_told_in_the_words_of_its_largest_part() -> None:
    parts = Leftover("time", "drifts", 0.2), Leftover("command", "bends", 0.5), Leftover("force", "hums", 0.3)
    diagnosis: Any = SimpleNamespace(suspects=(), leftover=parts)
    assert describe_leftover(diagnosis) == "bends, depending on command"
    suspected: Any = SimpleNamespace(suspects=(SimpleNamespace(sentence="it is in kg"),), leftover=parts)
    assert describe_leftover(suspected) == "it is in kg"


def seen(rms_n: float, usual_n: float | None, force_n: np.ndarray) -> float:
    reference: Any = SimpleNamespace(rms_n=lambda window: rms_n, floor_n=lambda window: usual_n)
    usable = np.ones(force_n.size, dtype=bool)
    window: Any = SimpleNamespace(measurement=SimpleNamespace(force_n=force_n, usable=usable))
    return excess_of(window, reference)


def test_what_is_usual_and_what_is_noise_is_no_excess() -> None:
    still, noisy = np.zeros(4000), np.random.default_rng(1).normal(0.0, 0.4, 4000)
    assert isclose(seen(0.5, None, still), 0.5)
    assert isclose(seen(0.5, 0.3, still), 0.4)
    assert seen(0.3, 0.5, still) == 0.0
    assert seen(0.5, 0.2, noisy) == pytest.approx(0.3, abs=0.03), "the larger of both, not their sum"


@pytest.mark.parametrize(
    ("excess_n", "weights_n", "cause"),
    [
        (0.5, (0.2, 0.4, 0.3), ResidualCause.EXTRA_LAG),
        (0.5, (0.2, 0.05, 0.3), ResidualCause.LEAK),
        (0.09, (0.2, 0.4, 0.3), ResidualCause.NONE),
        (0.5, (0.05, 0.05, 0.05), ResidualCause.UNKNOWN),
        (0.15, (0.05, 0.05, 0.05), ResidualCause.NONE),
    ],
)
def test_the_strongest_change_is_told_where_the_force_is_off_and_it_matters(
    excess_n: float, weights_n: tuple[float, ...], cause: ResidualCause, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = ("coulomb-friction", "extra-lag", "leak")
    changes = [PlantChange(name, (), (), force_n) for name, force_n in zip(names, weights_n, strict=True)]
    monkeypatch.setattr(window_verdict, "weigh_changes", lambda *_: changes)
    monkeypatch.setattr(window_verdict, "excess_of", lambda *_: excess_n)
    diagnosis: Any = SimpleNamespace(plant=None, suspects=(), leftover=())
    reference: Any = SimpleNamespace(plant=None)
    window: Any = SimpleNamespace(excitation_v=1.0)
    verdict = judge_window(window, diagnosis, reference, LEAST_N)
    assert verdict.cause is cause
    assert verdict.excitation_v == 1.0


def test_a_change_is_told_from_what_the_rigs_plant_says_to_what_the_window_shows(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    change = PlantChange("coulomb-friction", (("friction", "coulomb_n", "N"),), ("coulomb-friction", "creep"), 0.85)
    monkeypatch.setattr(window_verdict, "weigh_changes", lambda *_: [change])
    monkeypatch.setattr(window_verdict, "excess_of", lambda *_: 0.9)
    known, found = (SimpleNamespace(plant=Plant(friction=Friction(coulomb_n=value_n))) for value_n in (1.0, 2.4))
    window: Any = SimpleNamespace(excitation_v=1.0)
    diagnosis, reference = cast(Diagnosis, found), cast(WatchReference, known)
    assert judge_window(window, diagnosis, reference, LEAST_N).sentence == (
        "the force differs from the rig's plant by 0.85 N (rms): coulomb-friction, coulomb_n 1 -> 2.4 N; "
        "this run cannot tell it from creep"
    )


def test_the_lines_are_taken_out_of_the_first_window_alone_and_only_a_well_one_is_usual(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Taken out of each, a machine that comes later day by day never would; and a change that was found once was usual."""
    taken: list[str] = []
    reference: Any = SimpleNamespace(
        is_settled=False, plant=None, rms_n=lambda window: 1.0,
        take_line_delays=lambda diagnosis: taken.append("lines"), raise_floor=lambda window, rms_n: taken.append("floor"),
    )  # fmt: skip
    comparison = PlantComparison(reference, lambda *_: cast(Diagnosis, None), LEAST_N)
    window: Any = SimpleNamespace(measurement=None)
    for settled, cause, expected in (
        (False, ResidualCause.LEAK, ["lines"]),
        (True, ResidualCause.LEAK, []),
        (True, ResidualCause.UNKNOWN, []),
        (True, ResidualCause.NONE, ["floor"]),
    ):
        reference.is_settled = settled
        monkeypatch.setattr(plant_comparison, "judge_window", lambda *_, cause=cause: WindowVerdict(cause))
        taken.clear()
        assert comparison.judge(window).cause is cause and taken == expected
