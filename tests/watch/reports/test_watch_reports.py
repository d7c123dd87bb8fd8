"""What the process of the watch tells control, and what it hears from it."""

from dataclasses import replace
from math import inf, nan
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from gateway.registers.residual_cause import ResidualCause
from gateway.watch.force_watch import ForceWatch, PlantSince
from gateway.watch.memory import resident_mb
from gateway.watch.warning_filter import WindowVerdict
from gateway.watch.watch_process import _plant_of, _report, make_comparison
from tests.service.rigs import demo


def test_what_is_no_number_is_not_told() -> None:
    """JSON has none: control would refuse the whole report, and the warning with it."""
    watch: Any = SimpleNamespace(
        counters={"looks": 3, "rms_n": nan},
        published=WindowVerdict(ResidualCause.UNKNOWN, "x"),
        why_skipped="a fault stood",
    )
    force: Any = SimpleNamespace(sentence="")
    report = _report(watch, force, {"memory_mb": inf, "cpu_s": 1.0})
    assert report["counters"] == {"looks": 3, "cpu_s": 1.0}
    assert (report["sentence"], report["why_skipped"]) == ("x", "a fault stood")


def test_a_plant_is_in_use_since_control_says_so() -> None:
    """Rows of before it were commanded otherwise."""
    assert _plant_of({"plant": 3, "plant_since_s": 170.0}) == PlantSince(3, 170.0)
    assert _plant_of({}) is None


def test_what_is_less_than_a_quarter_of_the_band_disturbs_nobody(tmp_path: Path) -> None:
    """As A345 explains it."""
    control = demo().control
    rig = replace(demo(), control=replace(control, defaults=replace(control.defaults, in_band_tolerance_n=2.0)))
    assert make_comparison(rig, tmp_path)._least_n == 0.5  # type: ignore[attr-defined]
    assert ForceWatch(tmp_path, 2.0)._least_n == 0.5


def test_memory_is_told_in_megabytes() -> None:
    assert 5.0 < resident_mb() < 20_000.0
