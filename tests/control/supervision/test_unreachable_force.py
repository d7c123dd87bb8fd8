"""A force that is not reached: no air, another unit of force and no contact are told apart, where somebody can know."""

from dataclasses import replace
from math import isnan, nan

import pytest

from gateway.codes.faults import FaultCode
from gateway.codes.warning_bits import WarningBit
from gateway.control.supervision.unreachable_force import Evidence, unreachable_words
from gateway.registers.words import State, StatusBit
from tests.control.bench import Bench, has_fault, settings

PASCAL_PER_V = 0.09e6


class Measured(Bench):
    """A bench whose output device measures its pressure: where there is air, in proportion to the voltage."""

    by_profile_pa_per_v = PASCAL_PER_V

    def _measure(self) -> None:
        super()._measure()
        pressure_pa = self.plant._pressure * PASCAL_PER_V
        self.line = self.line._replace(pressure_pa=pressure_pa, pressure_pa_per_v=self.by_profile_pa_per_v)


def holding(bench: Bench, force_n: float = 12.0) -> Bench:
    bench.run(0.3)
    bench.enable(force_n)
    bench.run(2.0)
    assert bench.last.state is State.HOLDING
    return bench


def told(bench: Bench) -> str:
    bench.seconds_until(lambda output: bool(output.status & StatusBit.TARGET_UNREACHABLE), 8.0)
    (sentence,) = (event for event in bench.events if event.startswith("A301"))
    return sentence


def test_air_that_fails_while_holding_is_told_by_the_pressure() -> None:
    bench = holding(Measured(seed=1))
    bench.plant.air = False
    said = told(bench)
    assert " V out, " in said
    assert "0 kPa measured" in said
    assert "no air, or a closed valve" in said
    assert "contact" not in said


def test_what_is_reached_again_and_missed_again_is_told_again() -> None:
    bench = holding(Measured(seed=1))
    bench.plant.air = False
    told(bench)
    bench.plant.air = True
    bench.run(3.0)
    assert bench.last.state is State.HOLDING
    bench.events.clear()
    bench.plant.air = False
    told(bench)


def test_contact_that_is_lost_while_holding_is_told_by_the_pressure() -> None:
    bench = holding(Measured(seed=2))
    bench.plant.contact = False
    said = told(bench)
    assert "kPa measured" in said
    assert "air is there, so no contact" in said


def test_kgf_in_place_of_newton_while_holding_is_told_by_the_factor() -> None:
    for bench in (Measured(seed=3), Bench(seed=3)):
        holding(bench)
        bench.plant.unit = 1.0 / 9.80665
        said = told(bench)
        assert "is what kgf read as N looks like (A303)" in said
        assert ("air is there" in said) == isinstance(bench, Measured)


def test_newton_in_place_of_kgf_while_holding_is_told_by_the_factor() -> None:
    bench = holding(Measured(replace(settings(), limits=replace(settings().limits, over_force_n=90.0)), seed=4), 7.0)
    bench.plant.unit = 9.80665
    said = told(bench)
    assert "is what N read as kgf looks like (A303)" in said


def test_air_that_fails_under_a_voltage_is_told_though_friction_keeps_the_tool_in_contact() -> None:
    """HOLDING at 1 N of 24 was all that anybody was told, for good."""
    bench = holding(Measured(seed=1))
    bench.voltage(3.0)
    bench.run(1.0)
    assert bench.last.state is State.HOLDING and not bench.last.status & StatusBit.TARGET_UNREACHABLE
    bench.alter_sample = lambda sample: replace(sample, force_n=sample.force_n + 1.0)  # what friction keeps
    bench.plant.air = False
    said = told(bench)
    assert bench.last.status & StatusBit.CONTACT
    assert "0 kPa measured, 270 kPa expected: no air, or a closed valve" in said


@pytest.mark.parametrize("freezes", [False, True])
def test_a_quiet_cell_is_not_dead_where_there_is_no_air_to_move_it(freezes: bool) -> None:
    """It repeats the force that friction keeps, whatever voltage is out. When the air is back it must move."""
    bench = holding(Measured(seed=1, noise_n=0.0))
    bench.alter_sample = lambda sample: replace(sample, force_n=max(sample.force_n, 1.0))
    bench.plant.air = False
    assert "no air, or a closed valve" in told(bench)
    for force_n in (30.0, 8.0, 20.0):
        bench.force(force_n)
        bench.run(2.0)
        assert bench.last.fault is FaultCode.NONE and bench.last.status & StatusBit.CONTACT
    bench.cell_frozen, bench.plant.air = freezes, True
    bench.run(1.0)
    assert bench.last.fault is (FaultCode.SAMPLE_FROZEN if freezes else FaultCode.NONE)


@pytest.mark.parametrize("force_n", [3.0, 10.0])
def test_a_dead_cell_is_found_while_the_pressure_still_rises(force_n: float) -> None:
    bench = holding(Measured(seed=1, noise_n=0.0), force_n)
    bench.cell_frozen = True
    bench.force(35.0)
    assert bench.seconds_until(has_fault(FaultCode.SAMPLE_FROZEN), 2.0) <= 0.5


def test_without_a_pressure_what_was_right_before_counts_and_no_more_is_claimed() -> None:
    bench = holding(Bench(seed=5))
    bench.plant.air = False
    assert "the force was right before in this enable: contact lost or air gone" in told(bench)
    never = Bench(seed=5, contact=False)
    never.run(0.3)
    never.enable(12.0)
    assert told(never).endswith("no air, valve closed or no contact")


@pytest.mark.parametrize("pressure_pa", [nan, 24e3, 99e3, 140e3])
@pytest.mark.parametrize("factor", [0.02, 0.102, 0.6, 3.0, 9.81])
def test_whatever_is_seen_is_told_with_the_pressure_that_was_measured(pressure_pa: float, factor: float) -> None:
    seen = Evidence(voltage_v=1.0, measured_n=8.0 * factor, expected_n=8.0, pressure_pa=pressure_pa, expected_pa=100e3)
    told = unreachable_words(seen)
    assert "None" not in told and "nan" not in told
    assert isnan(replace(seen, expected_n=0.0).factor)
    assert told.startswith(f"{pressure_pa / 1e3:.0f} kPa measured, 100 kPa expected") or pressure_pa != pressure_pa
    assert factor < 1.0 or "no air" not in told, "more force than asked has air"


def test_a_force_that_was_right_before_this_enable_counts_for_nothing() -> None:
    bench = holding(Bench(seed=5))
    bench.disable()
    bench.run(0.5)
    bench.plant.air = False
    bench.enable(12.0)
    assert told(bench).endswith("no air, valve closed or no contact")


@pytest.mark.parametrize(("contact", "words"), [(False, "so no contact"), (True, "no air, or a closed valve")])
def test_before_anything_was_right_the_ranges_of_the_device_say_it(contact: bool, words: str) -> None:
    bench = Measured(seed=6, contact=contact, air=not contact)
    bench.run(0.3)
    bench.enable(12.0)
    assert words in told(bench)


def test_a_ratio_that_was_seen_counts_more_than_the_profiles() -> None:
    """A sensor of another range than the regulator's: by the profile half of the pressure is always missing."""
    bench = Measured(seed=7)
    bench.by_profile_pa_per_v = 6.0 * PASCAL_PER_V
    holding(bench)
    bench.plant.contact = False
    assert "air is there, so no contact" in told(bench)


@pytest.mark.parametrize(
    ("pressure_pa", "measured_n", "words"),
    [(nan, 0.1, "valve closed or no contact"), (60e3, 0.1, "valve closed or no contact"), (60e3, 3.2, "; target not")],
)
def test_between_the_bounds_nothing_is_claimed(pressure_pa: float, measured_n: float, words: str) -> None:
    learned = pressure_pa > 0.0
    seen = Evidence(
        voltage_v=1.0,
        measured_n=measured_n,
        expected_n=8.0,
        pressure_pa=pressure_pa,
        expected_pa=100e3,
        learned=learned,
    )
    assert words in unreachable_words(seen)
    assert ("60 kPa measured, 100 kPa expected" in unreachable_words(seen)) == learned


@pytest.mark.parametrize(
    ("measured_n", "was_in_band", "is_told"),
    [(0.29, False, True), (0.2, False, True), (0.05, False, False), (0.29, True, False)],
)
def test_a_tenth_of_a_small_force_names_kgf_beside_the_missing_contact(
    measured_n: float, was_in_band: bool, is_told: bool
) -> None:
    seen = Evidence(voltage_v=0.26, measured_n=measured_n, expected_n=3.1, pressure_pa=24e3, expected_pa=24e3)
    seen = replace(seen, was_in_band=was_in_band)
    assert "air is there, so no contact with the workpiece" in unreachable_words(seen)
    assert ("kgf read as N" in unreachable_words(seen)) == is_told
    assert ("(A303): check the unit on the amplifier" in unreachable_words(seen)) == is_told


@pytest.mark.parametrize(("measured_n", "expected_n"), [(0.29, 12.0), (0.29, 1.3), (0.14, 1.4)])
def test_a_small_force_of_another_factor_does_not_name_kgf(measured_n: float, expected_n: float) -> None:
    seen = Evidence(voltage_v=0.3, measured_n=measured_n, expected_n=expected_n, pressure_pa=24e3, expected_pa=24e3)
    assert unreachable_words(seen).endswith("no contact with the workpiece")


def test_without_a_pressure_less_than_half_of_the_force_may_be_no_air_and_half_of_it_is_not() -> None:
    words = [unreachable_words(Evidence(voltage_v=3.0, measured_n=n, expected_n=10.0)) for n in (2.4, 4.9, 5.0)]
    assert words[0] == "no air, valve closed or no contact" and words[2].startswith("target not reached")
    assert words[1].startswith("no air or too little of it") and "contact" not in words[1], "what is felt is touched"
    assert all("the load cell's span" in each for each in words[1:]), "else who reads it calibrates with a wrong cell"


def test_a_force_that_weight_keeps_above_the_target_is_not_missing_air() -> None:
    """12.8 N pressed where 5 were wanted, at 0 V, and the supply was blamed for too little pressure."""
    bench = Bench(seed=8)
    bench.run(0.3)
    bench.enable(5.0, payload_kg=1.2)
    said = told(bench)
    assert (
        "more than the 5.0 N that are wanted, and no lower voltage is possible: friction, the payload's weight" in said
    )
    assert "supply" not in said and "air" not in said


def test_a_machine_that_is_stronger_than_its_calibration_is_not_missing_air() -> None:
    bench = Bench(seed=9, gain_n_per_v=9.5)
    bench.run(0.3)
    bench.enable(30.0)
    said = told(bench)
    assert "more than the 30.0 N that are wanted: trim at its limit, calibration or the load cell's span off" in said
    assert "supply" not in said


def test_a_band_that_is_narrower_than_any_force_stands_is_no_matter_of_air() -> None:
    """1 in the register for 1 N is 0.01 N: 20.0 N of 20 N were called a supply pressure that is too low."""
    bench = Measured(seed=1)
    bench.run(0.3)
    bench.enable(20.0, in_band_tolerance_n=0.01)
    said = told(bench)
    assert "N off: in_band_tolerance is too small" in said and "supply" not in said and "calibration" not in said


@pytest.mark.parametrize(
    ("measured_n", "is_near"), [(9.71, True), (9.69, False), (10.29, True), (10.31, False), (nan, False)]
)
def test_only_what_is_next_to_its_target_is_blamed_on_the_band(measured_n: float, is_near: bool) -> None:
    seen = Evidence(voltage_v=1.0, measured_n=measured_n, expected_n=10.0, target_n=10.0)
    assert ("in_band_tolerance" in unreachable_words(seen)) is is_near
    low = replace(seen, measured_n=0.9, target_n=1.0)
    assert "in_band_tolerance" not in unreachable_words(low), "so little may be noise, or friction without air"


@pytest.mark.parametrize(("voltage_v", "is_lowest"), [(0.0, True), (0.4, False)])
def test_what_friction_keeps_at_no_voltage_need_not_be_another_unit(voltage_v: float, is_lowest: bool) -> None:
    seen = Evidence(voltage_v=voltage_v, measured_n=9.6, expected_n=0.5, target_n=3.0, is_lowest=is_lowest)
    assert unreachable_words(seen).startswith("more than the 3.0 N that are wanted") == is_lowest
    assert "N read as kgf" in unreachable_words(seen)
    assert ("N read as kgf" not in unreachable_words(replace(seen, was_in_band=True))) == is_lowest


@pytest.mark.parametrize(("share", "learned", "no_air"), [(0.3, True, True), (0.3, False, False), (0.1, False, True)])
def test_how_little_is_no_air_depends_on_whether_enough_was_seen(share: float, learned: bool, no_air: bool) -> None:
    evidence = Evidence(
        voltage_v=4.0, measured_n=1.0, expected_n=20.0, pressure_pa=share * 4.0e5, expected_pa=4.0e5, learned=learned
    )
    assert evidence.no_air is no_air


@pytest.mark.parametrize("span", [0.78, 0.8])
def test_a_force_in_band_by_the_whole_trim_is_told_with_what_a_wrong_span_would_spoil(span: float) -> None:
    """HOLDING, a bit of the warning word, and no line: 24 N pressed for 20 N, and the cure was to calibrate with that cell."""
    bench = Bench(settings(), seed=1, unit=span)
    bench.run(0.3)
    for _ in range(2):  # once in an enable
        bench.events.clear()
        bench.enable(20.0)
        bench.run(8.0)
        assert (bench.last.state, bench.last.warnings) == (State.HOLDING, WarningBit.TRIM_SATURATED)
        assert bench.plant.force_n > 24.0
        (said,) = (event for event in bench.events if event[:4] in ("A340", "A301"))
        assert " 19." in said and " 24." in said, "what the cell says, and the model"
        assert "its limit" in said and "span is off" in said and "known weight" in said
        bench.disable()
        bench.run(1.0)


@pytest.mark.parametrize("span", [0.9, 1.0, 1.16])
def test_a_trim_within_its_range_says_nothing_and_a_missed_target_only_that(span: float) -> None:
    bench = Bench(settings(), seed=1, unit=span)
    bench.run(0.3)
    bench.enable(20.0)
    bench.run(8.0)
    told_codes = [event[:4] for event in bench.events if event.startswith("A3")]
    assert told_codes == (["A301"] if span > 1.1 else [])
