"""A device's own watchdog is fed in time whatever else the wire has to carry, and no more than that."""

from itertools import pairwise

import pytest

from gateway.devices import output_device, output_host
from gateway.devices.messages import Accepted, AskDevice, DeviceAnswer, DeviceStep, ReadVoltage, SetVoltage
from gateway.service.running_rig.lines.output_line import OutputExchange
from tests.profile_files import load_device

FEED = b"~**\r"
ROUND_TRIP_S = 0.003


class FedLine:
    """An output whose device answers each setting and look; written: what went out, and when."""

    def __init__(self) -> None:
        profile = load_device("icpdas-702x")
        self.host, self.device = output_host(profile), output_device(profile)
        self.written: list[tuple[float, bytes]] = []
        self.exchange = OutputExchange(self.host, lambda data: self.written.append((self.now_s, data)), 0.1)
        self.now_s, self.stands_v = 100.0, 0.0
        while step := self.exchange.checks.next_step(self.now_s):  # it is what it should be, and armed
            text = "armed" if step is DeviceStep.STATUS else ""
            self.exchange.checks.take(DeviceAnswer(step, is_right=True, text=text))

    def run(self, seconds: float, step_v: float) -> None:
        """Let the setpoint move by so much at each answer."""
        until_s, voltage_v = self.now_s + seconds, 0.0
        while self.now_s < until_s:
            self.now_s += ROUND_TRIP_S
            if self.written and self.written[-1][0] < self.now_s:
                for asked in self.device.receive(self.written[-1][1], self.now_s):
                    if isinstance(asked, AskDevice):
                        said = DeviceAnswer(asked.step, is_right=True, text="armed")
                        self.exchange.on_bytes(self.device.reply(said, to=asked), self.now_s)
                    elif isinstance(asked, SetVoltage | ReadVoltage) and self.exchange.unanswered_since_s is not None:
                        self.stands_v = asked.voltage_v if isinstance(asked, SetVoltage) else self.stands_v
                        self.exchange.on_bytes(self.device.reply(Accepted(self.stands_v), to=asked), self.now_s)
            voltage_v = (voltage_v + step_v) % 10.0
            self.exchange.set_voltage(voltage_v, self.now_s)
            self.exchange.tick(self.now_s)

    @property
    def feeds(self) -> list[float]:
        return [at_s for at_s, data in self.written if data == FEED]


@pytest.fixture
def line() -> FedLine:
    return FedLine()


def test_a_setpoint_that_never_rests_does_not_starve_the_watchdog(line: FedLine) -> None:
    """A wire that always has a setting to carry: the device would let go in the middle of a path."""
    line.run(4.0, step_v=0.1)
    assert len(line.written) > 100
    longest_s = max(later_s - before_s for before_s, later_s in pairwise(line.feeds))
    assert longest_s <= line.host.feed_period_s + 2 * ROUND_TRIP_S
    assert len(line.feeds) <= 4.0 / line.host.feed_period_s + 2


def test_a_device_has_its_time_for_a_sentence_that_it_does_not_answer(line: FedLine) -> None:
    """Nothing tells when it is through with it: the next one would be lost."""
    line.run(2.0, step_v=0.1)
    behind_s = [later[0] - before[0] for before, later in pairwise(line.written) if before[1] == FEED]
    assert len(behind_s) > 3
    assert min(behind_s) >= 0.005


def test_behind_a_pause_of_the_machine_it_is_fed_once_and_not_for_each_time_that_was_missed(line: FedLine) -> None:
    """The voltage waits for it."""
    line.run(1.0, step_v=0.1)
    fed = len(line.feeds)
    line.now_s += 20.0 * line.host.feed_period_s
    line.run(0.5 * line.host.feed_period_s, step_v=0.1)
    assert len(line.feeds) == fed + 1


def test_the_safe_voltage_waits_for_no_sign_of_life(line: FedLine) -> None:
    """As seed 272935 drew it: both were due at once, and the safe voltage went out a tick later, 40 ms at 25 Hz."""
    line.run(0.5, step_v=0.1)
    while line.exchange.unanswered_since_s is not None:
        line.run(ROUND_TRIP_S, step_v=0.0)
    line.now_s += 1.01 * line.host.feed_period_s
    line.written.clear()
    line.exchange.set_voltage(0.0, line.now_s)
    assert [data for _, data in line.written] == [line.host.request(SetVoltage(0.0))]
    line.run(3 * ROUND_TRIP_S, step_v=0.0)
    assert line.written[1][1] == FEED
