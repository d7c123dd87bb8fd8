"""Where a loop woke late, a setting may be in no row: what follows is no witness until it is forgotten."""

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gateway.diagnosis import Measurement, verdict
from gateway.diagnosis.bench.bench import bench_of
from gateway.diagnosis.bench.parameters import ModelParameters
from gateway.diagnosis.bench.recording_drive import rows_after_unseen_settings
from gateway.diagnosis.notes import recording_notes
from gateway.profiles import load_plant

ROW_S = 0.01


def stairs(missing: Sequence[int], *, even_s: float = ROW_S, late_steps: bool = True) -> Measurement:
    """20 s on even rows, a step of 1 V every 2 s up to the middle, then (or not) back; no reading in the rows `missing`."""
    rows = 2000
    height = np.arange(rows) // 200
    command_v = np.where(height < 5, height, 9 - height if late_steps else 4).astype(float)
    usable = np.ones(rows, dtype=bool)
    usable[list(missing)] = False
    return Measurement(
        name="stairs",
        time_s=np.arange(rows) * ROW_S,
        force_n=8.0 * command_v,
        usable=usable,
        repeated=np.zeros(rows, dtype=bool),
        command_v=command_v,
        even_s=even_s,
    )


def test_after_a_gap_at_a_step_rows_count_again_a_second_after_the_next_step() -> None:
    """The step itself may have come before or after what was lost; the next one wipes it out."""
    unseen = rows_after_unseen_settings(stairs([400]))
    assert 400 + unseen[400:].argmin() == pytest.approx(600 + 100, abs=1)
    assert not unseen[:400].any()
    assert not unseen[701:].any()


def test_where_nothing_wipes_it_out_a_quarter_of_the_recording_goes_at_most() -> None:
    unseen = rows_after_unseen_settings(stairs([800], late_steps=False))
    assert unseen[800:].argmin() == pytest.approx(500, abs=1)


@pytest.mark.parametrize(
    "measurement",
    [stairs([]), stairs([300]), stairs([400], even_s=0.0), stairs(range(198, 2000, 200))],
    ids=["no gap", "gap while nothing moves", "rows as recorded", "gaps everywhere"],
)
def test_nothing_goes(measurement: Measurement) -> None:
    """Without a gap, where nothing moves in it, where no reader has made rows even, or where nothing would be left."""
    assert not rows_after_unseen_settings(measurement).any()


def test_the_bench_does_not_judge_these_rows() -> None:
    judged = bench_of([stairs([400])]).judged
    assert not judged[400:700].any()
    assert judged[750:].all()


def test_that_these_rows_are_not_judged_is_told_and_no_figure_shows_them() -> None:
    """A report said that the simulation is off by 0.12 N, above a plot of a residual of 1.2 N for four seconds."""
    (note,) = recording_notes([stairs([400])], [0.0], 0.1)
    assert note.startswith(
        "stairs: 299 of 1999 readings are not judged, between 4.0 and 7.0 s: the gateway's loop was late"
    )
    assert not list(recording_notes([stairs([])], [0.0], 0.1))
    bench = bench_of([stairs([400])])
    model: Any = SimpleNamespace(parameters=ModelParameters(load_plant("paper-slide").plant, (0.0,)))
    reported: Any = SimpleNamespace(base=model, fitted=model)
    (trace,) = verdict._traces(bench, reported)
    assert (trace.measurement.usable == bench.judged).all()


def test_each_recording_is_drawn_with_its_own_simulation() -> None:
    bench = bench_of([stairs([400]), replace(stairs([]), name="whole")])
    model: Any = SimpleNamespace(parameters=ModelParameters(load_plant("paper-slide").plant, (0.0, 0.0)))
    reported: Any = SimpleNamespace(base=model, fitted=model)
    assert [trace.measurement.name for trace in verdict._traces(bench, reported)] == ["stairs", "whole"]
