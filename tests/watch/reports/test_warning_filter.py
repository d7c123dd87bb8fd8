"""When the warning of the residual watch rises, what it is called, and when it falls."""

from gateway.registers.residual_cause import ResidualCause as C
from gateway.watch.warning_filter import WarningFilter, WindowVerdict


def after(*findings: WindowVerdict) -> C:
    warning = WarningFilter()
    for finding in findings:
        warning.add(finding)
    return warning.published.cause


def names_cause(cause: C, *others: str, excitation_v: float = 1.0) -> WindowVerdict:
    return WindowVerdict(cause, cause.effect, excitation_v, (cause.effect, *others))


FRICTION, DELAY = names_cause(C.COULOMB_FRICTION), names_cause(C.TRANSPORT_DELAY)
FINE = WindowVerdict(excitation_v=1.0)


def test_one_window_does_not_raise_the_warning():
    assert after(FRICTION) is C.NONE
    assert after(FRICTION, FINE, FRICTION) is C.NONE


def test_two_in_a_row_give_the_name():
    assert after(FRICTION, FRICTION) is C.COULOMB_FRICTION


def test_two_that_differ_raise_it_without_a_name_until_two_agree():
    """A window in which the change happened may be misnamed."""
    assert after(DELAY, FRICTION) is C.UNKNOWN
    assert after(DELAY, FRICTION, FRICTION) is C.COULOMB_FRICTION


def test_members_of_one_group_agree_and_the_name_stays():
    offset = names_cause(C.CLOCK_OFFSET, "transport-delay")
    delay = names_cause(C.TRANSPORT_DELAY, "clock-offset")
    assert after(delay, delay, offset) is C.TRANSPORT_DELAY
    assert after(offset, delay) is C.TRANSPORT_DELAY


def test_one_that_could_be_the_other_is_not_it_while_the_other_could_not_be_that_one():
    """The second window has told the two apart."""
    either = names_cause(C.TRANSPORT_DELAY, "clock-offset")
    assert after(either, names_cause(C.CLOCK_OFFSET)) is C.UNKNOWN
    assert after(names_cause(C.CLOCK_OFFSET), either) is C.UNKNOWN


def test_of_what_has_no_name_the_newest_sentence_is_told():
    warning = WarningFilter()
    for n in (0.3, 0.4, 0.9):
        warning.add(WindowVerdict(C.UNKNOWN, f"{n} N are off", 1.0))
    assert (warning.published.cause, warning.published.sentence) == (C.UNKNOWN, "0.9 N are off")


def test_another_cause_takes_its_place_after_two_windows():
    assert after(FRICTION, FRICTION, DELAY) is C.COULOMB_FRICTION
    assert after(FRICTION, FRICTION, DELAY, DELAY) is C.TRANSPORT_DELAY


def test_a_window_that_agrees_clears_it():
    assert after(FRICTION, FRICTION, FINE) is C.NONE


def test_a_window_that_could_not_have_seen_it_clears_nothing():
    """Nobody moved: that is no sign of health."""
    still = WindowVerdict(excitation_v=0.1)
    assert after(FRICTION, FRICTION, still) is C.COULOMB_FRICTION
    assert after(FRICTION, still, FRICTION) is C.COULOMB_FRICTION


def test_numbers_are_the_catalogues_in_its_order():
    from gateway.diagnosis import EFFECTS

    assert [effect.name for effect in EFFECTS] == [cause.effect for cause in C if 0 < cause < 99]
    assert [int(cause) for cause in C] == [*range(46), 99]


def test_an_effect_that_the_map_does_not_know_is_unknown():
    assert C.of_effect("extra-lag") is C.EXTRA_LAG
    assert C.of_effect("gain") is C.UNKNOWN
