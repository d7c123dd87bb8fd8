"""Behind an answer that was lost or garbled the line finds back to its answers, whatever moves meanwhile."""

from gateway.codes.faults import FaultCode
from gateway.devices import output_device, output_host
from gateway.devices.messages import (
    Accepted,
    AskDevice,
    DeviceAnswer,
    DeviceStep,
    Pressure,
    ReadPressure,
    ReadVoltage,
    Refused,
    SetVoltage,
)
from gateway.service.running_rig.lines.output_line import OutputExchange
from tests.profile_files import load_device
from tests.service.running_rig.lines.output.played_output import REPLY_TIMEOUT_S, Wire, wire

__all__ = ["wire"]


def test_a_device_that_has_become_slower_is_not_given_up_at_each_of_its_answers() -> None:
    """Its answers came 6 ms later than the last whole one: the rest of each seemed to garble the next one's, which was given
    up in the middle of it, for ever."""
    profile, written = load_device("mcu-line"), list[bytes]()
    device, exchange = output_device(profile), OutputExchange(output_host(profile), written.append, 0.05)
    coming: list[tuple[float, bytes]] = []
    for step in range(1000):
        now_s = 100.0 + 0.001 * step
        for asked in (one for data in written for one in device.receive(data, now_s)):
            assert isinstance(asked, SetVoltage | ReadPressure | AskDevice)
            said = Pressure(0.0) if isinstance(asked, ReadPressure) else Accepted(0.0)
            answer = device.reply(
                DeviceAnswer(asked.step, is_right=True) if isinstance(asked, AskDevice) else said, asked
            )
            slow_s = 0.006 if step > 200 else 0.0
            noise = [(now_s + 0.005, b"#\n")] if 200 < step < 310 else []
            coming += [*noise, (now_s + 0.016 + slow_s, answer[:4]), (now_s + 0.020 + slow_s, answer[4:])]
        written.clear()
        for due in [piece for piece in coming if piece[0] <= now_s]:
            coming.remove(due)
            exchange.on_bytes(due[1], now_s)
        exchange.set_voltage(0.0, now_s)
        exchange.tick(now_s)
    assert exchange.unanswered_since_s is None or now_s - exchange.unanswered_since_s < 0.05
    assert exchange.counts.garbled < 12 and exchange.checks.is_done


def test_a_round_trip_is_not_told_by_an_answer_that_may_be_an_older_ones(wire: Wire) -> None:
    """A late one was taken for the answer to a question of a moment ago: what was garbled next was given up while the question
    to it was still on the wire, and the device heard one sentence of two."""
    wire.settle(200)
    before_s = wire.exchange.round_trip_s
    wire.set_voltage(300)
    wire.tick(REPLY_TIMEOUT_S + 0.001)
    wire.answer("300", after_s=0.001)
    assert wire.exchange.round_trip_s == before_s


class FallingLine:
    """A device that answers at once, and a setpoint that falls at every other answer."""

    def __init__(self) -> None:
        profile = load_device("icpdas-702x")
        self.device, self.written = output_device(profile), list[bytes]()
        self.exchange = OutputExchange(output_host(profile), self.written.append, REPLY_TIMEOUT_S)
        self.now_s, self.stands_v, self.is_lost, self.is_refusing = 100.0, 0.0, False, False

    def run(self, seconds: float, begin_v: float, step_v: float) -> None:
        turns, until_s = 0, self.now_s + seconds
        while self.now_s < until_s:
            self.now_s, turns = self.now_s + 0.005, turns + 1
            heard = [one for data in self.written for one in self.device.receive(data, self.now_s)]
            self.written.clear()
            for asked in heard:
                assert isinstance(asked, SetVoltage | ReadVoltage | AskDevice)
                self.stands_v = asked.voltage_v if isinstance(asked, SetVoltage) else self.stands_v
                said = (
                    DeviceAnswer(asked.step, is_right=True) if isinstance(asked, AskDevice) else Accepted(self.stands_v)
                )
                refused = Refused("?01") if self.is_refusing and isinstance(asked, SetVoltage) else said
                if not self.is_lost:
                    self.exchange.on_bytes(self.device.reply(refused, to=asked), self.now_s)
                self.is_lost = False
            self.exchange.set_voltage(max(0.1, begin_v - step_v * (turns // 6)), self.now_s)
            self.exchange.tick(self.now_s)


def test_while_the_voltage_falls_a_lost_answer_leaves_no_doubt_of_all_that_come_later() -> None:
    """Each fall in the quiet time behind a doubtful answer made the next one doubtful: of a device that had forgotten its
    watchdog no look was believed for as long as the voltage fell."""
    line = FallingLine()
    line.run(0.5, 9.0, 0.0)
    assert line.exchange.checks.is_armed and line.device.watchdog
    line.is_lost = True
    line.device.watchdog.do(DeviceStep.DISARM, None, line.now_s)
    line.run(2.0, 9.0, 0.1)
    assert line.exchange.checks.times_forgotten == 1 and line.exchange.checks.is_armed
    assert line.exchange.fault is FaultCode.NONE and line.stands_v > 0.0


def test_a_device_that_refuses_each_fall_behind_a_lost_answer_is_found() -> None:
    """Each refusal came in the quiet time behind the one before, which it prolonged: while it fell none was believed."""
    line = FallingLine()
    line.run(0.5, 9.0, 0.0)
    line.is_lost = line.is_refusing = True
    line.run(0.5, 9.0, 0.1)
    assert line.exchange.fault is FaultCode.OUTPUT_REFUSED


def test_a_refusal_behind_a_read_that_was_given_up_is_the_setting_s(wire: Wire) -> None:
    """It repeats nothing that was asked before: taken for the late answer of the read, it left the setting unanswered."""
    wire.settle(200)
    asked = len(wire.written)
    while len(wire.written) == asked or wire.last != "MON":
        wire.tick()
    wire.tick(REPLY_TIMEOUT_S + 0.001)
    assert wire.last == "SET 200" and wire.exchange.unanswered_since_s is not None
    wire.answer("OUT OF RANGE")
    assert wire.exchange.unanswered_since_s is None
