"""When the tool touches, and when it does not any more."""

from math import nan

import pytest

from gateway.control.sample_conditioning import Reading
from gateway.control.supervision.contact_detection import ContactDetector

STEP_S = 0.02


def felt(detector: ContactDetector, *forces_n: float) -> bool:
    for force_n in forces_n:
        detector.update(Reading(force_n, force_n, interval_s=STEP_S, is_new=True, is_fresh=True, is_usable=True))
    return detector.touching


def test_two_samples_touch_and_a_tenth_of_a_second_without_a_break_releases() -> None:
    detector = ContactDetector(1.0)
    assert not felt(detector, 1.0, 0.9, 1.0)
    assert felt(detector, 1.0, 1.0)
    assert felt(detector, 0.6, *[0.4] * 4)
    assert felt(detector, *[0.5, 0.4, 0.4] * 20), "a break begins the tenth anew"
    assert not felt(detector, *[0.4] * 5)


@pytest.mark.parametrize("nothing", [{"is_new": False}, {"is_usable": False, "contact_n": nan, "overload": True}])
def test_a_reading_that_is_old_or_none_neither_counts_nor_breaks_a_count(nothing: dict[str, object]) -> None:
    detector, pressed = ContactDetector(0.5), Reading(1.0, 1.0, 0.0, 0.01, True, True, True)
    between = pressed._replace(**nothing)  # type: ignore[arg-type]
    assert not detector.update(pressed)
    assert not detector.update(between)
    assert detector.update(pressed)


@pytest.mark.parametrize("interval_s", [0.1, 0.4])
def test_one_sample_of_a_slow_cell_alone_ends_no_contact(interval_s: float) -> None:
    """Of a cell of 10 Hz one that was false stood for a tenth of a second: the force fell to the pre-contact one."""
    detector = ContactDetector(0.5)
    felt(detector, 20.0, 20.0)
    nothing, pressed = (Reading(n, n, interval_s=interval_s, is_new=True, is_usable=True) for n in (0.0, 20.0))
    assert detector.update(nothing) and detector.update(pressed) and detector.update(nothing)
    assert not detector.update(nothing)
