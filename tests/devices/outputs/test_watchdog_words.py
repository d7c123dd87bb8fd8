"""What a rehearsed device says of its watchdog, where it has fewer words than states."""

from dataclasses import replace

from gateway.devices import output_device
from gateway.devices.device_checks.watchdog import WatchdogQuestion, WatchdogState
from gateway.devices.messages import AskDevice, DeviceAnswer, DeviceStep
from tests.profile_files import load_device


def test_a_device_without_a_word_for_armed_says_off_and_not_the_first_word_that_it_has() -> None:
    """The first one here says that it has tripped."""
    profile = load_device("icpdas-702x")
    assert profile.watchdog
    words = {"04": WatchdogState.TRIPPED, "00": WatchdogState.OFF}
    status = WatchdogQuestion(ask="~{address:02X}0", answer="!{address:02X}{state:04|00}", words=words)
    device = output_device(replace(profile, watchdog=replace(profile.watchdog, status=status)))
    (asked,) = device.receive(b"~010\r", 0.0)
    assert asked == AskDevice(DeviceStep.STATUS)
    device.receive(b"~013105\r", 0.0)  # armed, 0.5 s
    answer = DeviceAnswer(DeviceStep.STATUS, is_right=True)
    assert device.reply(answer, asked) == b"!0100\r"
    assert device.elapse(9.0), "it trips"
    assert device.reply(answer, asked) == b"!0104\r"
