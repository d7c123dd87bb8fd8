"""The time of a device's watchdog in its own counts: never a longer one than was asked for, and none that is less than one."""

from dataclasses import replace

import pytest

from gateway.devices import output_device
from gateway.devices.device_checks.watchdog import Watchdog
from gateway.devices.messages import Garbage, SetVoltage
from tests.profile_files import load_device


def watchdog_of(time_s: float, tick_s: float = 0.1) -> Watchdog:
    watchdog = load_device("icpdas-702x").own_watchdog
    assert watchdog
    return replace(watchdog, time_s=time_s, tick_s=tick_s)


@pytest.mark.parametrize(
    ("time_s", "ticks"), [(0.1, 1), (0.14, 1), (0.16, 1), (0.2, 2), (0.3, 3), (0.35, 3), (0.99, 9), (1.0, 10)]
)
def test_what_is_sent_is_what_was_asked_for_or_the_next_shorter_one(time_s: float, ticks: int) -> None:
    """0.3 s is three counts of 0.1 s, whatever binary fractions make of it; a longer one would let a tool press for longer."""
    assert watchdog_of(time_s).ticks == ticks


@pytest.mark.parametrize("time_s", [0.05, 0.06, 0.099])
def test_less_than_one_count_is_refused_and_not_made_one(time_s: float) -> None:
    with pytest.raises(
        ValueError, match=f"{time_s:g} s is less than one count of the watchdog, 0.1 s: it would trip later"
    ):
        watchdog_of(time_s)


@pytest.mark.parametrize(("time_s", "tick_s"), [(0.1, 0.1), (0.35, 0.1), (25.5, 0.1), (0.5, 0.5)])
def test_it_is_fed_four_times_in_the_time_that_the_device_has(time_s: float, tick_s: float) -> None:
    watchdog = watchdog_of(time_s, tick_s)
    assert 4.0 * watchdog.feed_period_s == pytest.approx(watchdog.ticks * tick_s)
    assert 4.0 * watchdog.feed_period_s <= time_s * (1.0 + 1e-9)


def test_a_simulated_device_obeys_no_setting_from_its_trip_until_it_is_cleared() -> None:
    """A rehearsal would show force back where a real device stands at its safe value."""
    device, setting = output_device(load_device("icpdas-702x")), b"#0105.000\r"
    device.receive(b"~013105\r", 0.0)  # armed, 0.5 s
    assert device.receive(setting, 0.4) == [SetVoltage(5.0)]
    (refused,) = device.receive(setting, 1.0)
    assert isinstance(refused, Garbage) and device.reply(device.refusal(refused)) == b"!\r"
    device.receive(b"~011\r", 1.1)
    assert device.receive(setting, 1.2) == [SetVoltage(5.0)]
