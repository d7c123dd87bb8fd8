"""What an output device was asked before is asked again: by a reset, behind a silence, and of a port that is opened anew; and
what it did not answer is held against it only in a row."""

from dataclasses import replace

import pytest

from gateway.codes.faults import FaultCode
from gateway.devices import output_device, output_host
from gateway.devices.messages import Accepted, AskDevice, DeviceAnswer, DeviceStep, ReadVoltage, SetVoltage
from gateway.service.running_rig.lines.device_checks import DeviceChecks
from gateway.service.running_rig.lines.output_line import OutputExchange
from tests.profile_files import load_device

DEVICE = "icpdas-702x"
IDENTITY, STATUS, ARM, VERIFY = DeviceStep.IDENTITY, DeviceStep.STATUS, DeviceStep.ARM, DeviceStep.VERIFY
MISSES = 5
REPLY_TIMEOUT_S, ROUND_TRIP_S = 0.06, 0.003


def checks_of_it(*, is_armed: bool = False) -> DeviceChecks:
    checks = DeviceChecks(output_host(load_device(DEVICE)), is_waived=False)
    if is_armed:
        answer_all(checks)
    return checks


def answer_all(checks: DeviceChecks) -> list[DeviceStep]:
    """What was asked, each answered as a device does that is well."""
    asked = []
    while not checks.is_done and (step := checks.next_step(0.0)):
        asked.append(step)
        text = "" if step is not STATUS else "armed" if ARM in asked else "off"
        checks.take(DeviceAnswer(step, is_right=True, text=text))
    return asked


@pytest.mark.parametrize("is_refused", [True, False])
def test_a_reset_asks_a_wrong_device_anew_what_it_is(is_refused: bool) -> None:
    """It was exchanged, or its answer was spoiled: without it only a new start of the gateway would find out."""
    checks = checks_of_it()
    checks.refuse(IDENTITY, "WHAT?") if is_refused else checks.take(
        DeviceAnswer(IDENTITY, is_right=False, text="a lamp")
    )
    assert checks.fault is FaultCode.WRONG_DEVICE
    checks.clear()
    assert answer_all(checks) == [IDENTITY, STATUS, ARM, VERIFY]
    assert (checks.fault, checks.said, checks.is_armed) == (FaultCode.NONE, "", True)


def test_the_next_device_behind_the_port_is_not_armed_because_the_one_before_was() -> None:
    checks = checks_of_it(is_armed=True)
    assert checks.is_armed
    checks.begin()
    assert not checks.is_armed


def test_a_device_that_misses_a_question_now_and_then_is_not_refused() -> None:
    """Five of one question in a row are a device without words for it; a noisy line loses some of each."""
    checks = checks_of_it()
    while not checks.is_done and (step := checks.next_step(0.0)):
        for _ in range(MISSES - 1):
            checks.miss(step)
        assert checks.next_step(0.0) is step
        checks.take(DeviceAnswer(step, is_right=True, text="off" if step is STATUS else ""))
    assert (checks.fault, checks.is_armed) == (FaultCode.NONE, True)
    checks.begin()
    for _ in range(MISSES):
        checks.miss(IDENTITY)
    assert checks.fault is FaultCode.WRONG_DEVICE


@pytest.mark.parametrize("has_verify", [True, False])
def test_a_look_that_is_not_answered_is_no_word_against_an_armed_watchdog(has_verify: bool) -> None:
    """A busy wire loses some: armed anew each time, its setpoints would wait for that."""
    profile = load_device(DEVICE)
    watchdog = profile.own_watchdog
    assert watchdog
    known = profile if has_verify else replace(profile, watchdog=replace(watchdog, verify=None))
    checks = DeviceChecks(output_host(known), is_waived=False)
    answer_all(checks)
    assert checks.is_armed
    for now_s in range(2 * MISSES):
        step = checks.next_step(float(now_s))
        assert step
        checks.miss(step)
    assert (checks.is_armed, checks.is_done, checks.fault) == (True, True, FaultCode.NONE)


def test_a_look_whose_answer_was_lost_is_repeated_soon_and_twice_at_most() -> None:
    """A device that was off has forgotten its arming, and the answer behind a lost one may be another question's: with a whole
    period per look it pressed unwatched for three of them. A device without words for it is asked no more often for that."""
    checks = checks_of_it(is_armed=True)
    looks_s = [0.1 * tick for tick in range(50) if checks.next_step(0.1 * tick)]
    assert looks_s == pytest.approx([0.0, 0.1, 0.2, 1.2, 2.2, 3.2, 4.2])
    assert checks.is_late(5.2)
    checks.take(DeviceAnswer(STATUS, is_right=True, text="armed"))
    assert (checks.next_step(5.1), checks.next_step(5.2), checks.is_late(5.6)) == (None, STATUS, True)


def test_what_was_never_armed_has_not_forgotten_it() -> None:
    """W249 says that the device was off meanwhile: not so where its first tries fail."""
    checks = checks_of_it()
    for _ in range(2):
        for step in (IDENTITY, STATUS, ARM):
            checks.take(DeviceAnswer(step, is_right=True, text="off" if step is STATUS else ""))
        checks.take(DeviceAnswer(VERIFY, is_right=False))
    assert checks.times_forgotten == 0
    answer_all(checks)
    checks.take(DeviceAnswer(VERIFY, is_right=False))
    assert (checks.is_armed, checks.times_forgotten) == (False, 1)


class PlayedLine:
    """Answered is each question but those in `deaf_to`; asked: what the device was asked about itself."""

    def __init__(self) -> None:
        profile = load_device(DEVICE)
        self.device, self.now_s, self.stands_v = output_device(profile), 100.0, 0.0
        self.deaf_to: tuple[DeviceStep, ...] = ()
        self.is_silent = False
        self.asked: list[DeviceStep] = []
        self.settings: list[float] = []
        self.written: list[bytes] = []
        self.exchange = OutputExchange(output_host(profile), self.written.append, REPLY_TIMEOUT_S)

    def run(self, seconds: float, step_v: float = 0.0) -> float:
        """Let the setpoint rise by so much at each answer; the oldest silence that the line has told."""
        until_s, oldest_s = self.now_s + seconds, 0.0
        while self.now_s < until_s:
            self.now_s += ROUND_TRIP_S
            for data in [self.written.pop(0) for _ in self.written[:]]:
                for asked in self.device.receive(data, self.now_s):
                    self.hear(asked)
            self.exchange.set_voltage(min(10.0, (self.exchange.sent_v or 0.0) + step_v), self.now_s)
            self.exchange.tick(self.now_s)
            since_s = self.exchange.unanswered_since_s
            oldest_s = max(oldest_s, 0.0 if since_s is None else self.now_s - since_s)
        return oldest_s

    def hear(self, asked: object) -> None:
        if self.is_silent or (isinstance(asked, AskDevice) and asked.step in self.deaf_to):
            return
        if isinstance(asked, AskDevice):
            self.asked.append(asked.step)
            self.exchange.on_bytes(self.device.reply(DeviceAnswer(asked.step, is_right=True)), self.now_s)
        elif isinstance(asked, SetVoltage | ReadVoltage):
            if isinstance(asked, SetVoltage):
                self.stands_v = asked.voltage_v
                self.settings.append(asked.voltage_v)
            self.exchange.on_bytes(self.device.reply(Accepted(self.stands_v), to=asked), self.now_s)


def test_a_device_that_was_silent_for_long_is_asked_anew_what_it_is_and_armed_anew() -> None:
    """Its plug was pulled, or another one put in its place: what answers then may be anybody, and does not watch."""
    line = PlayedLine()
    line.run(0.5)
    assert line.asked[:4] == [IDENTITY, STATUS, ARM, VERIFY] and line.exchange.checks.is_done
    line.is_silent = True
    line.run(0.4)
    line.is_silent = False
    line.run(0.3)
    assert IDENTITY not in line.asked[4:], "a short silence is none"
    line.is_silent = True
    line.run(0.8)
    del line.asked[:]
    line.is_silent = False
    line.run(0.5)
    assert IDENTITY in line.asked, "perhaps behind a look that was under way"
    assert line.asked[line.asked.index(IDENTITY) :][:4] == [IDENTITY, STATUS, ARM, VERIFY]
    assert line.exchange.checks.is_done


@pytest.mark.parametrize("begun_s", [0.5, 0.75, 1.0, 1.25, 1.5])
def test_a_device_that_was_silent_for_long_hears_the_safe_voltage_anew(begun_s: float) -> None:
    """Its watchdog may have tripped, or its supply: what was commanded last, which it reads back, need not be what is out."""
    line = PlayedLine()
    line.run(begun_s)
    line.is_silent = True
    line.run(0.7)
    line.is_silent = False
    del line.settings[:]
    line.run(0.5)
    assert line.settings and set(line.settings) == {0.0}


def test_an_arming_that_nobody_answers_leaves_every_other_turn_to_the_setpoint() -> None:
    """A device that has forgotten it, under a force that rises: asked alone, it would be taken for a silent one."""
    line = PlayedLine()
    line.run(0.5)
    assert line.device.watchdog
    line.device.watchdog.do(DeviceStep.DISARM, None, line.now_s)
    line.deaf_to = (ARM,)
    assert line.run(2.0, step_v=0.01) < 2.0 * REPLY_TIMEOUT_S
    assert line.exchange.checks.times_forgotten == 1 and line.stands_v > 0.1


@pytest.mark.parametrize(
    ("next_v", "begun_s", "gives_way"), [(5.0, 0.1, True), (3.0, 0.1, False), (3.0, 0.5, True), (0.0, 0.5, False)]
)
def test_a_setting_gives_way_to_a_late_question_one_that_falls_seldom_and_the_safe_one_never(
    next_v: float, begun_s: float, gives_way: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """begun_s: since the device was asked about itself. In a long fall it was not, and its watchdog did not watch."""
    line = PlayedLine()
    line.run(begun_s)
    line.exchange.set_voltage(4.0, line.now_s)
    monkeypatch.setattr(line.exchange.checks, "is_late", lambda now_s: True)
    monkeypatch.setattr(line.exchange.checks, "next_step", lambda now_s: STATUS)
    line.exchange.set_voltage(next_v, line.now_s)
    answer = line.device.reply(Accepted(4.0), to=SetVoltage(4.0))
    line.written.clear()
    line.exchange.on_bytes(answer, line.now_s + ROUND_TRIP_S)
    line.exchange.tick(line.now_s + 4.0 * ROUND_TRIP_S)  # behind a sign of life, perhaps
    asked = [one for data in line.written for one in line.device.receive(data, line.now_s)]
    assert asked == [AskDevice(STATUS) if gives_way else SetVoltage(next_v)]


@pytest.mark.parametrize("device", [DEVICE, "mcu-line"])
def test_a_watchdog_that_watches_with_another_time_is_armed_anew(device: str) -> None:
    """Power was away for a moment, or somebody set it: it says armed, and would trip later than the rig was promised."""
    checks = DeviceChecks(output_host(load_device(device)), is_waived=False)
    answer_all(checks)
    assert checks.is_armed and not checks.times_forgotten
    looks = []
    for second in range(1, 12):
        if checks.is_done and (step := checks.next_step(float(second))):
            looks.append(step)
            checks.take(DeviceAnswer(step, is_right=step is not VERIFY, text="armed" if step is STATUS else ""))
    assert looks[0] is STATUS and looks[-1] is VERIFY and looks.count(VERIFY) == 1
    assert checks.times_forgotten == 1 and ARM in answer_all(checks)
    assert checks.is_armed and not checks.fault


def test_who_waives_a_watchdog_is_told_all_the_same_that_it_has_tripped() -> None:
    """A tripped device obeys nothing, whether it was wanted or not."""
    checks = DeviceChecks(output_host(load_device(DEVICE)), is_waived=True)
    answer_all(checks)
    assert checks.is_done
    checks.trip()
    assert (checks.fault, checks.is_done, checks.is_tripped) == (FaultCode.WATCHDOG_TRIPPED, False, True)


@pytest.mark.parametrize("ends_by_arming", [True, False])
def test_a_trip_that_ends_when_it_is_armed_anew_ends_with_the_reset(ends_by_arming: bool) -> None:
    """Asked for its state first it said tripped, and was never armed: each reset was followed by the same fault (WAGO 750)."""
    profile = load_device(DEVICE)
    watchdog = profile.own_watchdog
    assert watchdog
    checks = DeviceChecks(output_host(replace(profile, watchdog=replace(watchdog, clear=None))), is_waived=False)
    answer_all(checks)
    checks.trip()
    checks.clear()
    state, asked = "tripped", []
    for _ in range(9):
        if checks.is_done or (step := checks.next_step(0.0)) is None:
            break
        asked.append(step)
        state = "armed" if step is ARM and ends_by_arming else state
        checks.take(DeviceAnswer(step, is_right=True, text=state if step is STATUS else ""))
    assert asked[0] is ARM and asked[-1] is STATUS
    assert (checks.is_armed, checks.fault is FaultCode.WATCHDOG_TRIPPED) == (ends_by_arming, not ends_by_arming)
