"""The setpoint's path and the rig's own lead, against numbers worked out by hand."""

from math import exp

import pytest

from gateway.control import LeadSettings, Limits, Trim
from gateway.control.force_loop.lead_compensator import LeadCompensator
from gateway.control.force_loop.setpoint_trend import MOST_N, SetpointTrend
from gateway.control.force_loop.transient_estimate import STAYS_N, TransientEstimate
from gateway.control.force_loop.transport_delay import TransportDelay
from gateway.control.force_loop.trim import TrimIntegral
from gateway.registers.words import LimitedBy

LIMITS = Limits(force_max_n=50.0, over_force_n=60.0, voltage_max_v=8.5)
STEP_S = 0.03125


def path(*values_n: float, step_s: float = STEP_S) -> SetpointTrend:
    trend = SetpointTrend()
    for value_n in values_n:
        trend.advance(value_n, step_s)
    return trend


def test_a_parabola_is_continued_as_one() -> None:
    def at(k: float) -> float:
        return 10.0 + 0.4 * k + 0.05 * k * k

    trend = path(*(at(k) for k in range(6)))
    for later in (1, 2, 3):
        assert trend.ahead_n(later * STEP_S) == pytest.approx(at(5 + later) - at(5))
    trend.advance(at(5), 0.5 * STEP_S)
    assert trend.ahead_n(0.5 * STEP_S) == pytest.approx(at(6) - at(5)), "from when the last value came"


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_path_is_one_from_four_values_and_a_tenth_of_a_second_on(way: float) -> None:
    values = [20.0 + way * k for k in range(6)]
    assert path(*values[:4], step_s=0.03).ahead_n(0.03) == 0.0, "90 ms"
    assert path(*values[:4], step_s=0.035).ahead_n(0.035) == pytest.approx(way)
    assert path(*values[:3], step_s=0.055).ahead_n(0.03) == 0.0
    assert path(*values, step_s=0.065).ahead_n(0.03) == 0.0, "too seldom"


def test_a_jump_ends_a_path_and_a_value_that_comes_too_soon_waits() -> None:
    values = [10.0 + k for k in range(6)]
    assert path(*values, 17.0).ahead_n(STEP_S) == pytest.approx(1.0, abs=0.8)
    assert path(*values, 17.1).ahead_n(STEP_S) == 0.0
    trend = path(*values)
    trend.advance(15.5, 0.003)
    assert trend.ahead_n(STEP_S - 0.003) == pytest.approx(1.0), "as if it had not come"


def test_a_path_that_stands_is_over_behind_two_intervals_and_a_fifth() -> None:
    trend = path(*(10.0 + k for k in range(6)))
    trend.advance(15.0, 2.19 * STEP_S)
    assert trend.ahead_n(0.01) > 0.0
    trend.advance(15.0, 0.02 * STEP_S)
    assert trend.ahead_n(0.01) == 0.0


def test_what_scatters_is_continued_by_what_scatter_could_not_have_made_and_never_by_more_than_its_bound() -> None:
    smooth = [10.0 + k for k in range(6)]
    rough = [one + 0.1 * (k in (1, 4)) for k, one in enumerate(smooth)]
    assert 0.0 < path(*rough).ahead_n(3.0 * STEP_S) < path(*smooth).ahead_n(3.0 * STEP_S) == pytest.approx(3.0)
    assert path(*smooth).ahead_n(9.0 * STEP_S) == MOST_N
    assert path(*(-one for one in smooth)).ahead_n(9.0 * STEP_S) == -MOST_N
    to_and_fro = [10.0 + 0.5 * (k % 2) for k in range(6)]
    assert path(*to_and_fro).ahead_n(STEP_S) == 0.0


def test_behind_a_restart_there_is_no_path() -> None:
    trend = path(*(10.0 + k for k in range(6)))
    trend.restart()
    assert trend.ahead_n(0.1) == 0.0
    trend.advance(16.0, STEP_S)
    assert trend.ahead_n(0.1) == 0.0


@pytest.mark.parametrize(
    ("lag_s", "second_s", "left_s"), [(0.1, 0.0, 0.035), (0.1, 0.06, 0.028), (0.06, 0.1, 0.028), (0.02, 0.0, 0.02)]
)
def test_a_lead_leaves_a_third_of_the_lags_and_gains_the_rest(lag_s: float, second_s: float, left_s: float) -> None:
    lead = LeadCompensator(LeadSettings(lag_s=lag_s, second_lag_s=second_s), LIMITS)
    assert lead.gained_s == pytest.approx(lag_s + second_s - (2.0 if second_s else 1.0) * left_s)


def test_a_lead_makes_its_model_follow_one_lag_as_the_shorter_one_would() -> None:
    lead, dt_s = LeadCompensator(LeadSettings(lag_s=0.1), LIMITS), 1e-4
    lead.go_on_from(3.0, 3.0)
    for _ in range(350):
        lead.advance(lead.compensated_v(3.5), dt_s)
    assert lead.first_v == lead.second_v == pytest.approx(3.5 - 0.5 * exp(-1.0), rel=2e-3)


def test_a_lead_makes_its_model_follow_two_lags_as_two_shorter_ones_would() -> None:
    lead, dt_s = LeadCompensator(LeadSettings(lag_s=0.1, second_lag_s=0.06), LIMITS), 1e-4
    lead.go_on_from(3.0, 3.0)
    for _ in range(280):
        lead.advance(lead.compensated_v(3.2), dt_s)
    assert lead.second_v == pytest.approx(3.2 - 0.2 * 2.0 * exp(-1.0), abs=2e-3)


def test_a_lead_without_lags_passes_every_wish_and_one_with_them_pushes_within_the_range() -> None:
    none, one = LeadCompensator(LeadSettings(), LIMITS), LeadCompensator(LeadSettings(lag_s=0.1), LIMITS)
    none.advance(4.0, 0.01)
    assert (none.first_v, none.second_v, none.compensated_v(7.0), none.gained_s) == (4.0, 4.0, 7.0, 0.0)
    assert (one.compensated_v(7.0), one.compensated_v(9.5)) == (8.5, 9.5)
    one.go_on_from(7.0, 7.0)
    assert (one.compensated_v(1.0), one.compensated_v(7.0005)) == (0.0, 7.0005)


def test_a_lead_begins_at_the_safe_voltage_and_pushes_no_lower_than_the_range() -> None:
    limits = Limits(force_max_n=50.0, over_force_n=60.0, voltage_min_v=1.0, voltage_max_v=8.5, safe_voltage_v=1.5)
    lead = LeadCompensator(LeadSettings(lag_s=0.1, second_lag_s=0.05), limits)
    assert lead.compensated_v(1.5) == 1.5
    lead.advance(8.0, 1.0)
    assert lead.compensated_v(1.2) == 1.0
    assert lead.compensated_v(0.5) == 0.5, "a wish outside the range passes"


def test_nearly_equal_lags_follow_a_voltage_as_equal_ones_do() -> None:
    """The general form divides by their difference."""
    for second_s in (0.1, 0.1 * (1.0 - 1e-15), 0.1 * (1.0 - 1e-12), 0.1 * (1.0 - 1e-8)):
        lead = LeadCompensator(LeadSettings(lag_s=0.1, second_lag_s=second_s), LIMITS)
        lead.advance(4.0, 0.1)
        assert lead.second_v == pytest.approx(4.0 * (1.0 - 2.0 * exp(-1.0)), rel=1e-6), second_s


def test_a_delay_gives_what_was_so_long_ago() -> None:
    delay = TransportDelay(0.25)
    delay.restart(5.0)
    assert [delay.advance(float(k), 0.125) for k in range(5)] == [5.0, 5.0, 0.0, 1.0, 2.0]
    assert TransportDelay(0.0).advance(7.0, 0.1) == 7.0
    delay.advance(8.0, 0.125)
    delay.restart(2.0)
    assert [delay.advance(3.0, 0.125) for _ in range(4)] == [2.0, 2.0, 3.0, 3.0], "nothing of before is on its way"


def test_an_error_that_falls_with_the_lag_is_taken_for_one_that_goes_away_and_one_that_stays_is_not() -> None:
    goes, stays = TransientEstimate(), TransientEstimate()
    for estimate in (goes, stays):
        estimate.lag_s = 0.1
        estimate.push(-20.0)
        estimate.push(5.0)
    for k in range(40):
        goes.observe(1.5 * exp(-0.1 * k), 0.05, 0.01)
        stays.observe(1.0, 0.05, 0.01)
        if k == 8:
            assert goes.transient_n > 0.3 > abs(goes._stays_n)
    assert abs(goes.transient_n) < 0.05 and stays._stays_n == pytest.approx(1.0, abs=0.1)
    stays.correct(0.4)
    assert stays._stays_n == pytest.approx(0.6, abs=0.1)
    stays.restart()
    assert (stays._stays_n, stays.transient_n, stays._stays_n2) == (0.0, 0.0, STAYS_N**2)


def test_a_trim_adds_what_is_beyond_its_dead_zone_up_to_its_limit_and_fades_over_its_memory() -> None:
    trim = TrimIntegral(Trim(gain_v_per_n_s=2.0, limit_v=0.5, dead_zone_n=0.25, memory_n=10.0))
    trim.integrate(0.25, 0.1)
    trim.integrate(-0.25, 0.1)
    assert trim.value_v == 0.0
    trim.integrate(0.75, 0.1)
    assert trim.value_v == pytest.approx(0.1) and trim.limited_by is LimitedBy.NONE
    trim.integrate(-0.5, 0.1)
    assert trim.value_v == pytest.approx(0.05)
    trim.integrate(9.0, 1.0)
    assert (trim.value_v, trim.limited_by) == (0.5, LimitedBy.TRIM_RANGE)
    trim.travel(-5.0)
    assert trim.value_v == pytest.approx(0.5 * exp(-0.5)) and trim.limited_by is LimitedBy.NONE
    trim.resume(-0.7)
    assert (trim.value_v, trim.limited_by) == (-0.5, LimitedBy.TRIM_RANGE)
    trim.reset()
    assert (trim.value_v, trim.limited_by, trim.has_hunted) == (0.0, LimitedBy.NONE, False)
