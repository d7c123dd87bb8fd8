"""A device that answers a setting by the same bytes, behind an adapter that hears itself: alive, and dead."""

import random

import pytest

from gateway.devices import DeviceProfile, output_device, output_host
from gateway.devices.messages import Accepted, SetVoltage
from gateway.service.running_rig.lines.output_line import OutputExchange
from tests.profile_files import load_device

ALLOWED_S = 0.3  # of silence
REST_S = 0.2  # in which a reading tells an adapter that hears itself
WAVESHARE = load_device("waveshare-ao8b")


class Bus:
    """The line with its device, which dies at dies_s; every byte takes its time, the device 4 ms more."""

    def __init__(self, profile: DeviceProfile, dies_s: float, *, has_echo: bool) -> None:
        self.host = output_host(profile)
        self.exchange = OutputExchange(self.host, self.write, profile.reply_timeout_s)
        self._device, self._character_s = output_device(profile), profile.serial.character_s
        self._dies_s, self._has_echo = dies_s, has_echo
        self._coming: list[tuple[float, bytes]] = []
        self._stands_v = self.now_s = 0.0

    def write(self, data: bytes) -> None:
        through_s = self.now_s + len(data) * self._character_s
        if self._has_echo:
            self._coming.append((through_s, data))
        for asked in self._device.receive(data, self.now_s) if self.now_s < self._dies_s else []:
            if isinstance(asked, SetVoltage):
                self._stands_v = asked.voltage_v
            answer = self._device.reply(Accepted(self._stands_v), asked)
            self._coming.append((through_s + 0.004 + len(answer) * self._character_s, answer))

    def silent_s(self, until_s: float, change_v: float) -> float:
        """The longest silence that was noticed, while behind a moment of rest another voltage is wanted at each tick."""
        chance, wanted_v, longest_s = random.Random(7), 3.0, 0.0
        for step in range(round(until_s * 1000)):
            self.now_s = step / 1000
            for due in [due for due in self._coming if due[0] <= self.now_s]:
                self._coming.remove(due)
                self.exchange.on_bytes(due[1], self.now_s)
            if step % 10 == 0:
                wanted_v += chance.uniform(-change_v, change_v) if self.now_s > REST_S else 0.0
                self.exchange.tick(self.now_s)
                self.exchange.set_voltage(wanted_v, self.now_s)
            since_s = self.exchange.unanswered_since_s
            longest_s = max(longest_s, 0.0 if since_s is None else self.now_s - since_s)
        return longest_s


@pytest.mark.parametrize("has_echo", [True, False])
@pytest.mark.parametrize("change_v", [0.0, 0.0005, 0.001, 0.005, 0.02])
def test_a_dead_device_is_silent_though_its_adapter_repeats_each_setting(change_v: float, has_echo: bool) -> None:
    """Its settings were confirmed by our own words for as long as they changed, seven seconds and more."""
    assert Bus(WAVESHARE, 2.0, has_echo=has_echo).silent_s(2.2 + ALLOWED_S, change_v) > ALLOWED_S - 0.05


@pytest.mark.parametrize("has_echo", [True, False])
@pytest.mark.parametrize("change_v", [0.0, 0.001, 0.02])
def test_one_that_lives_is_not(change_v: float, has_echo: bool) -> None:
    bus = Bus(WAVESHARE, 99.0, has_echo=has_echo)
    assert bus.silent_s(5.0, change_v) < 0.1
    assert bus.host.hears_itself is has_echo
