"""The valve's line in virtual time: one question is out, the readback decides, an order goes out once, silence has an age."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from gateway.codes.faults import FaultCode
from gateway.control.settings import ValveControl
from gateway.devices import DeviceProfile, ValveDevice, ValveDirection, ValveHost
from gateway.devices.binary.rtu_framing import rtu_frame
from gateway.registers.words import State
from gateway.service.running_rig.lines.valve_line import ValveExchange
from tests.control.bench import settings
from tests.profile_files import load_device
from tests.service.running_rig.simulated_rig import VALVE, SmallRig

PUSH, PULL = ValveDirection
PROFILE = load_device("waveshare-relay")


class Relay:
    """The device behind the line; takes_s: until its answer; deaf: it hears nothing."""

    def __init__(self, stands: ValveDirection = PUSH, profile: DeviceProfile = PROFILE) -> None:
        self.device, self.stands = ValveDevice(profile), stands
        self.now_s = 0.0
        self.is_deaf = self.is_stuck = False
        self.refusal = b""  # of each setting
        self.asked: list[tuple[float, ValveDirection | None]] = []
        self.answers: list[tuple[float, bytes]] = []
        self.shown: set[ValveDirection | None] = set()
        self.line = ValveExchange(ValveHost(profile), self.hear, profile.reply_timeout_s)

    def hear(self, data: bytes) -> None:
        if self.is_deaf:
            return
        (question,) = self.device.receive(data)
        assert question is None or isinstance(question, ValveDirection)
        assert not self.answers, "a second question while one is out"
        self.asked.append((self.now_s, question))
        if question is not None and not self.is_stuck and not self.refusal:
            self.stands = question
        answer = self.refusal if self.refusal and question else self.device.reply(question, self.stands)
        self.answers.append((self.now_s + 0.02, answer))

    def run(self, seconds: float, order: ValveDirection | None = None) -> "Relay":
        for _ in range(round(seconds * 200)):
            self.now_s += 0.005
            while self.answers and self.answers[0][0] <= self.now_s:
                self.line.on_bytes(self.answers.pop(0)[1], self.now_s)
            self.line.tick(self.now_s)
            self.line.set_direction(order, self.now_s)
            self.shown.add(self.line.status.stands)
        return self

    @property
    def orders(self) -> list[ValveDirection]:
        return [question for _, question in self.asked if question is not None]


def test_nothing_is_known_before_the_first_readback_which_is_repeated() -> None:
    relay = Relay(PULL)
    assert relay.line.status.stands is None
    relay.run(1.0)
    assert relay.line.status == (PULL, None, False, "") and relay.orders == []
    assert 9 <= len(relay.asked) <= 11


@pytest.mark.parametrize(
    ("name", "refusal", "words"),
    [
        ("waveshare-relay", rtu_frame(1, b"8502"), "exception 2 (illegal data address)"),
        ("mcu-valve", b"ERR 7\n", "'ERR 7'"),
    ],
)
def test_a_relay_that_refuses_is_quoted_until_it_obeys_or_the_order_is_gone(
    name: str, refusal: bytes, words: str
) -> None:
    relay = Relay(profile=load_device(name))
    relay.run(0.3, PULL)
    relay.refusal = refusal
    relay.run(0.5, PUSH)
    assert relay.line.status.stands is PULL and relay.line.status.said == words
    assert relay.run(0.3, PULL).line.status.said == "", "it stands where it is to stand"
    assert relay.run(0.5, PUSH).line.status.said == words
    relay.refusal = b""
    assert relay.run(0.5, PUSH).line.status.stands is PUSH and relay.line.status.said == ""
    relay.refusal = refusal
    relay.run(0.5, PULL).line.reset()
    assert relay.line.status.said == "", "another device may be behind the port"


def test_half_an_answer_does_not_spoil_the_next_one() -> None:
    """Of words with a line end the half stood before the next answer, and the valve was silent for as long again."""
    relay = Relay(PULL, load_device("mcu-valve")).run(0.5)
    while not relay.answers:
        relay.run(0.005)
    (due_s, answer), asked = relay.answers[0], len(relay.asked)
    relay.answers[:] = [(due_s, answer[:-2])]
    while len(relay.asked) == asked:
        relay.run(0.005)
    relay.run(0.03)
    assert relay.line.status.unanswered_since_s is None and relay.line.counts.garbled == 0


def test_an_order_waits_until_the_valve_has_said_where_it_stands() -> None:
    relay = Relay()
    relay.line.set_direction(PULL, relay.now_s)
    relay.run(0.5, PULL)
    assert [question for _, question in relay.asked[:2]] == [None, PULL]


@pytest.mark.parametrize("polls", range(20))
def test_an_order_goes_out_once_and_its_readback_follows_at_once(polls: int) -> None:
    """Wherever between two readings it comes."""
    relay = Relay().run(0.5 + 0.005 * polls, PUSH)
    began_s = relay.now_s
    relay.run(0.5, PULL)
    assert relay.orders == [PULL] and relay.line.status.stands is PULL
    told_s = next(at_s for at_s, question in relay.asked if question is PULL)
    read_s = next(at_s for at_s, question in relay.asked if at_s > told_s)
    assert told_s - began_s < 0.035 and read_s - told_s < 0.045


def test_without_an_order_a_valve_that_moved_is_left_alone() -> None:
    relay = Relay(PULL).run(0.5, PULL)
    relay.stands = PUSH
    relay.run(0.5, None)
    assert relay.line.status.stands is PUSH and relay.orders == []
    relay.run(0.5, PULL)
    assert relay.orders == [PULL] and relay.line.status.stands is PULL


def test_a_relay_that_does_not_move_keeps_its_readback_and_is_told_again() -> None:
    relay = Relay().run(0.3)
    relay.is_stuck = True
    relay.run(1.0, PULL)
    assert relay.line.status.stands is PUSH and 2 < len(relay.orders) < 12
    assert relay.shown == {None, PUSH}, "an answer to an order is no readback"


def test_a_port_that_is_back_is_lost_no_more() -> None:
    rig, relay = SmallRig(), Relay(PULL).run(0.5)
    rig.loop.valve = relay.line
    rig.loop.on_valve_closed()
    assert (relay.line.status.lost, relay.line.status.stands) == (True, None)
    rig.loop.on_valve_opened()
    assert (relay.line.status.lost, relay.run(0.5).line.status.stands) == (False, PULL)


class ValveRig(SmallRig):
    """A rig with this relay at its valve."""

    def __init__(self) -> None:
        super().__init__(replace(settings(), valve=ValveControl(pull_area_share=0.75)))
        self.relay = Relay()
        self.loop.valve = self.relay.line

    def _tick(self) -> None:
        if hasattr(self, "relay"):
            relay, relay.now_s = self.relay, self.now()
            while relay.answers and relay.answers[0][0] <= relay.now_s:
                self.loop.on_valve_bytes(relay.answers.pop(0)[1], relay.now_s)
        super()._tick()


def test_unplugged_and_replugged_between_two_ticks_is_a_fault_all_the_same() -> None:
    """Another relay may be behind the name now, and the valve elsewhere under the force."""
    rig = ValveRig().run(1.0).holding()
    rig.loop.on_valve_closed()
    rig.loop.on_valve_opened()
    assert (rig.state, rig.wire.voltage_v) == (State.FAULT, 0.0)
    assert rig.word("fault_code") == FaultCode.VALVE_SILENT


def test_what_is_pulled_is_in_the_ring_marked_for_the_watch_whose_plant_pushes() -> None:
    rig, rows = ValveRig(), list[tuple[float, ...]]()
    rig.loop.ring = SimpleNamespace(append=rows.append)  # type: ignore[assignment]
    rig.run(1.0)
    assert [row[-1] for row in rows] == [0.0] * 100
    rig.write(0, 1 | VALVE)
    rig.run(2.0)
    assert rig.relay.stands is PULL
    rows.clear()
    rig.run(1.0)
    assert [row[-1] for row in rows] == [1.0] * 100


def test_silence_has_an_age_until_an_answer_ends_it() -> None:
    relay = Relay().run(0.5)
    relay.is_deaf = True
    began_s = relay.now_s
    relay.run(0.7)
    since_s = relay.line.status.unanswered_since_s
    assert since_s is not None and since_s - began_s <= 0.11
    relay.is_deaf = False
    relay.run(0.3)
    assert relay.line.status.unanswered_since_s is None or relay.now_s - relay.line.status.unanswered_since_s < 0.035


def test_noise_moves_nothing_and_a_new_port_begins_with_nothing() -> None:
    relay = Relay().run(0.3)
    relay.line.on_bytes(bytes.fromhex("01050000FF008C3A"), relay.now_s)  # that nobody has asked for
    relay.run(0.3)
    assert relay.line.status.stands is PUSH
    relay.line.reset()
    assert relay.line.status.stands is None


@pytest.mark.parametrize(("name", "noise"), [("waveshare-relay", "01050000FF008C3A"), ("mcu-valve", "3f3f0d0a")])
def test_noise_frees_no_wire_and_half_an_answer_is_no_part_of_the_next(name: str, noise: str) -> None:
    relay = Relay(profile=load_device(name))
    relay.line.tick(0.0)
    assert len(relay.asked) == 1
    answer = relay.answers.pop()[1]
    relay.line.on_bytes(bytes.fromhex(noise), 0.01)
    relay.line.tick(0.02)
    assert len(relay.asked) == 1
    relay.line.on_bytes(answer[:3], 0.02)
    relay.line.tick(1.0)  # over its time
    assert len(relay.asked) == 2
    relay.line.on_bytes(relay.answers.pop()[1], 1.02)
    assert relay.line.status.stands is PUSH
    relay.answers.clear()
    relay.line.tick(2.0)
    relay.answers.clear()
    relay.line.on_bytes(answer[:3], 2.01)
    relay.line.reset()
    relay.line.tick(2.02)
    relay.line.on_bytes(answer, 2.03)
    assert relay.line.status.stands is PUSH, "nor of what a port says that was opened again"


def test_a_bus_has_its_silence_before_the_next_question_of_a_valve() -> None:
    relay, gap_s = Relay(), ValveHost(PROFILE).gap_s
    assert gap_s > 0.001
    relay.line.tick(0.0)
    relay.line.on_bytes(relay.answers.pop()[1], 0.02)
    relay.line.set_direction(PULL, 0.02 + 0.9 * gap_s)
    assert len(relay.asked) == 1
    relay.line.tick(0.02 + 1.1 * gap_s)
    assert relay.orders == [PULL]


def test_the_loop_asks_a_valve_again_whose_answer_was_lost() -> None:
    """Nothing else would: nobody orders it anywhere."""
    rig = ValveRig().run(1.0)
    rig.relay.is_deaf = True
    rig.run(0.5)
    rig.relay.is_deaf, asked = False, len(rig.relay.asked)
    rig.run(0.5)
    assert len(rig.relay.asked) > asked
    assert rig.now() - (rig.relay.line.status.unanswered_since_s or rig.now()) < 0.1


def test_an_answer_of_before_an_unplug_tells_nothing_behind_it() -> None:
    relay = Relay(PULL)
    relay.line.tick(relay.now_s)
    (_, answer) = relay.answers.pop()
    relay.line.reset()
    relay.line.on_bytes(answer, relay.now_s + 0.02)
    assert relay.line.status.stands is None


def test_a_valve_that_lost_its_power_is_told_anew_as_soon_as_it_has_said_where_it_stands() -> None:
    relay = Relay().run(0.5, PULL)
    assert relay.orders == [PULL]
    relay.answers.clear()
    relay.line.reset()
    relay.stands, before = PUSH, len(relay.asked)
    relay.run(0.5, PULL)
    (first_s, first), (then_s, then) = relay.asked[before : before + 2]
    assert (first, then) == (None, PULL) and then_s - first_s < 0.04
