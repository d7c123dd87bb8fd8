"""Wrong units, swapped columns and a turned sign are seen before any cause, each by its factor; what is right is left alone."""

from dataclasses import replace

import numpy as np
import pytest

from gateway.diagnosis import Measurement, Options, Verdict, diagnose
from gateway.diagnosis.input_checks import SWAPPED, TURNED, UNIT, find_suspects
from gateway.diagnosis.model_fit.base_fit import without_effects
from gateway.twin.plant import Plant, with_value
from gateway.twin.replay.replay import Drive, Replay
from gateway.units import LINEAR
from tests.diagnosis.machine import MACHINE, command_v, measurement, times_s

TIME_S = times_s(30.0, 100.0)
VOLTS = command_v(TIME_S)
PLAYED = Replay(Drive(time_s=TIME_S, command_v=VOLTS)).run([MACHINE])
FORCE_N = PLAYED.reading_n[0] + np.random.default_rng(4).normal(0.0, 0.1, TIME_S.size)
PRESSURE_PA = PLAYED.pressure_pa[0]
COMMANDED = measurement(TIME_S, VOLTS, FORCE_N, {})
PRESSED = replace(COMMANDED, command_v=None, pressure_pa=PRESSURE_PA)
BOTH = replace(COMMANDED, pressure_pa=PRESSURE_PA)
SMALLER = with_value(MACHINE, "cylinder", "area_m2", 60.0e-6)


def written_in(unit: str, quantity: str, own: str, values: np.ndarray) -> np.ndarray:
    """What somebody logs who takes `unit` for `own`."""
    return np.asarray(values * LINEAR[quantity][own][0] / LINEAR[quantity][unit][0])


def only(found: Measurement, plant: Plant = MACHINE, *, is_own: bool = True) -> tuple[str, str, str]:
    (one,) = find_suspects([found], plant, is_own=is_own)
    return one.code, one.column, one.unit or one.other


@pytest.mark.sampled
@pytest.mark.parametrize("is_own", [True, False])
@pytest.mark.parametrize("unit", ["kgf", "gf", "lbf", "mn", "kn"])
@pytest.mark.parametrize("given", [COMMANDED, PRESSED], ids=["command", "pressure"])
def test_a_force_in_another_unit(given: Measurement, unit: str, is_own: bool) -> None:
    wrong = replace(given, force_n=written_in(unit, "force", "n", FORCE_N))
    assert only(wrong, is_own=is_own) == (UNIT, "force_n", unit)
    assert find_suspects([wrong], MACHINE, is_own=True)[0].factor == pytest.approx(
        1.0 / LINEAR["force"][unit][0], rel=0.02
    )


@pytest.mark.parametrize("is_own", [True, False])
@pytest.mark.parametrize("unit", ["mv", "percent"])
def test_a_command_in_another_unit(unit: str, is_own: bool) -> None:
    wrong = replace(COMMANDED, command_v=written_in(unit, "voltage", "v", VOLTS))
    assert only(wrong, is_own=is_own) == (UNIT, "command_v", unit)


@pytest.mark.parametrize("unit", ["pa", "bar", "mbar", "mpa", "psi"])
@pytest.mark.parametrize("given", [PRESSED, BOTH], ids=["alone", "beside a command"])
def test_a_pressure_in_another_unit(given: Measurement, unit: str) -> None:
    wrong = replace(given, pressure_pa=written_in(unit, "pressure", "kpa", PRESSURE_PA))
    assert only(wrong) == (UNIT, "pressure_kpa", unit)


@pytest.mark.parametrize("is_own", [True, False])
def test_swapped_columns_and_a_turned_sign(is_own: bool) -> None:
    assert only(replace(COMMANDED, command_v=FORCE_N, force_n=VOLTS), is_own=is_own)[0] == SWAPPED
    swapped = replace(BOTH, pressure_pa=FORCE_N * 1.0e3, force_n=PRESSURE_PA * 1.0e-3)
    assert only(swapped, is_own=is_own) == (SWAPPED, "pressure_kpa", "force_n")
    assert only(replace(COMMANDED, force_n=-FORCE_N), is_own=is_own) == (TURNED, "force_n", "-n")


def test_what_is_right_is_left_alone_and_a_foreign_machine_may_be_of_another_size() -> None:
    for right in (COMMANDED, PRESSED, BOTH):
        assert find_suspects([right], MACHINE, is_own=True) == ()
        assert find_suspects([right], without_effects(MACHINE), is_own=False) == ()
    assert find_suspects([COMMANDED], SMALLER, is_own=False) == ()
    quiet = replace(COMMANDED, command_v=np.full(TIME_S.size, 2.0))
    assert find_suspects([quiet], MACHINE, is_own=True) == ()


def test_a_recording_of_hours_is_known_by_its_first_minutes() -> None:
    time_s = times_s(150.0, 100.0)
    volts = command_v(time_s)
    played_n = Replay(Drive(time_s=time_s, command_v=volts)).run([MACHINE]).reading_n[0]
    assert only(measurement(time_s, volts, played_n / 9.80665, {})) == (UNIT, "force_n", "kgf")
    assert find_suspects([measurement(time_s, volts, played_n, {})], MACHINE, is_own=True) == ()


def test_rows_of_a_millisecond_that_count_as_seconds_are_told_even_of_few_rows() -> None:
    (one,) = find_suspects([replace(COMMANDED, time_s=np.arange(float(TIME_S.size)))], MACHINE, is_own=True)
    assert (one.code, one.column, one.other, one.is_sure) == (UNIT, "time_s", "", False)


def test_only_the_rig_s_own_plant_or_a_number_beyond_any_makes_a_unit_sure() -> None:
    """The machine may be of another size: of what is asked only, causes are looked for all the same."""
    pounds = replace(COMMANDED, force_n=written_in("lbf", "force", "n", FORCE_N))
    millivolts = replace(COMMANDED, command_v=written_in("mv", "voltage", "v", VOLTS))
    for wrong, beyond in ((pounds, False), (millivolts, True)):
        for is_own in (True, False):
            (one,) = find_suspects([wrong], MACHINE, is_own=is_own)
            assert one.is_sure == (is_own or beyond)
            assert ("of another size" in one.sentence) != one.is_sure


def test_no_cause_is_looked_for_where_columns_are_wrong() -> None:
    wrong = replace(COMMANDED, force_n=FORCE_N / 9.80665)
    answer = diagnose([wrong], MACHINE, Options(is_own=True))
    assert answer.verdict is Verdict.UNKNOWN
    assert answer.causes == ()
    assert answer.plant == MACHINE, "nothing is refitted to numbers in another unit"
    assert answer.suspects[0].sentence.startswith("E520 machine: the force is 0.102 times what the rig's plant gives")
