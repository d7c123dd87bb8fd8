"""A real cylinder (Zillen, TU Delft, CC0): friction that is switched off in the model has to be found again, by so much.

The recordings are not part of the project: they are read from $FORCE_GATEWAY_DATA, else from shared/data beside it.
"""

import os
from collections.abc import Sequence
from dataclasses import fields, replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from gateway.diagnosis import Diagnosis, Measurement, Options, diagnose
from gateway.recording import read_table
from gateway.recording.measurement import measurement_of
from gateway.recording.tables.mapping_file import column_mapping
from tools.bench.cylinders import columns_of, held_out_rms_n

FOLDER = Path(os.environ.get("FORCE_GATEWAY_DATA") or Path(__file__).parents[3] / "shared" / "data")
DATA = FOLDER / "zillen-cylinder-friction"
COLUMNS = "time_s=1:ms,position_mm=5:mm,pressure_kpa=6:bar,force_n=7:n"
HIDDEN = "coulomb-friction"
FRICTION = {
    "coulomb-friction", "viscous-friction", "presliding", "load-dependent-friction", "asymmetric-friction", "stribeck-friction"
}  # fmt: skip
"""All that depends on the direction of motion: one speed per file cannot tell them apart."""

pytestmark = pytest.mark.skipif(
    not DATA.is_dir(), reason=f"NO REAL DATA: {DATA} is not there; FORCE_GATEWAY_DATA says where it is"
)


def recording(name: str) -> Measurement:
    return measurement_of(read_table(DATA / f"friction_{name}.csv", column_mapping(COLUMNS)))


def first_half(name: str) -> Measurement:
    whole = recording(name)
    values = {each.name: getattr(whole, each.name) for each in fields(whole)}
    return replace(
        whole, **{name: rows[: whole.rows // 2] for name, rows in values.items() if np.shape(rows) == (whole.rows,)}
    )


@cache
def diagnosed(names: tuple[str, ...], without: str | None = HIDDEN) -> Diagnosis:
    return diagnose([recording(name) for name in names], None, Options(without=without))


def names_of(found: Diagnosis) -> list[str]:
    return [cause.name for cause in found.causes]


def assert_friction_found(found: Diagnosis, most_n: float) -> None:
    """Strongest of all, and worth so much on blocks that the fit did not see."""
    assert found.causes, found.leftover
    strongest = found.causes[0]
    assert FRICTION & {strongest.name, *strongest.group}, names_of(found)
    assert strongest.gain.held_out_rms_after_n <= most_n
    assert strongest.gain.ci95[0] > 0.0
    assert found.extended.held_out_rms_n <= most_n


def test_the_tables_are_read_as_their_readme_says() -> None:
    found = recording("PK_1bar")
    assert found.pressure_pa is not None and found.position_m is not None and found.command_v is None
    assert 60.0 < found.duration_s < 95.0
    assert float(found.pressure_pa.mean()) == pytest.approx(1.0e5, rel=0.05)
    assert 0.03 < float(found.position_m.max() - found.position_m.min()) < 0.05


def test_hidden_friction_of_the_lip_seal_is_found(budget: int) -> None:
    """In a push half of the recording is asked, which takes a third less time."""
    found = diagnosed(("PK_1bar",)) if budget > 1 else diagnose([first_half("PK_1bar")], None, Options(without=HIDDEN))
    assert_friction_found(found, 0.27)
    assert 0.75 < found.baseline.rms_n < 1.1


@pytest.mark.long
def test_hidden_friction_of_the_o_ring_is_found() -> None:
    found = diagnosed(("O-ring257_1bar",))
    assert_friction_found(found, 0.65)
    assert 1.45 < found.baseline.rms_n < 1.75


@pytest.mark.long
@pytest.mark.parametrize("name", ["PK_3bar", "O-ring257_3bar"])
def test_friction_at_three_bar_is_the_strongest_cause(name: str) -> None:
    found = diagnosed((name,))
    assert_friction_found(found, 0.65 * found.baseline.rms_n)


@pytest.mark.long
@pytest.mark.parametrize("name", ["PK_1bar", "PK_3bar", "O-ring257_1bar", "O-ring257_3bar"])
def test_less_is_left_than_by_least_squares_with_the_place(name: str) -> None:
    """And no clock is blamed that nobody can tell from friction or from a pressure that comes late."""
    measurement, found = recording(name), diagnosed((name,), None)
    rows = measurement.usable
    assert found.extended.held_out_rms_n <= 0.75 * held_out_rms_n(
        columns_of(measurement)[rows], measurement.force_n[rows]
    )
    assert not [cause for cause in found.causes if cause.group == ("clock-offset",)], names_of(found)


def _both(without: str | None) -> Diagnosis:
    return diagnosed(("PK_1bar", "PK_3bar"), without)


@pytest.mark.long
def test_two_pressures_under_one_model_need_friction() -> None:
    found = _both(HIDDEN)
    assert_friction_found(found, 0.66)
    assert len(found.traces) == 2


@pytest.mark.long
def test_two_pressures_tell_friction_that_grows_with_the_load() -> None:
    """With dry friction in the base model, what it leaves grows with the pressure."""
    found = _both(None)
    everybody: Sequence[str] = [name for cause in found.causes for name in (cause.name, *cause.group)]
    assert "load-dependent-friction" in everybody, names_of(found)
    assert found.extended.held_out_rms_n <= 0.48
