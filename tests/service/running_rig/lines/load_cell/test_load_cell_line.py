"""A load cell that must be asked: one question on the wire, as fast as the wire allows, and never silent for a lost answer."""

from dataclasses import replace

import pytest

from gateway.codes.faults import FaultCode
from gateway.devices import DeviceProfile, cell_device, cell_host
from gateway.devices.device_checks.identity import Identity
from gateway.devices.force_reading import ForceReading
from gateway.devices.messages import ForceSample, Garbage
from gateway.service.running_rig.lines.load_cell_line import CellExchange
from tests.profile_files import load_device

TIMEOUT_S, ROUND_TRIP_S = 0.1, 0.02
READING = ForceReading(ask="W?", frame="W {force:+08.2f}", unit="N")
POLLED: DeviceProfile = replace(
    load_device("stream-st-gs"), name="polled", stream=None, read_force=READING, reply_timeout_s=TIMEOUT_S
)


class Wire:
    """What was asked, and the answers that a test gives."""

    def __init__(self, profile: DeviceProfile = POLLED) -> None:
        self.asked: list[bytes] = []
        self.exchange = CellExchange(cell_host(profile), self.asked.append, profile)
        self.device = cell_device(profile)
        self.now_s = 100.0
        self.samples: list[ForceSample] = []

    def tick(self, after_s: float = 0.01) -> None:
        self.now_s += after_s
        self.exchange.tick(self.now_s)

    def answer(self, force_n: float = 1.0, after_s: float = ROUND_TRIP_S) -> None:
        self.now_s += after_s
        self.hear(self.device.frame(force_n))

    def hear(self, chunk: bytes) -> None:
        found = self.exchange.receive(chunk, self.now_s)
        self.samples += [one for one in found if isinstance(one, ForceSample)]


@pytest.fixture
def wire() -> Wire:
    return Wire()


def test_a_stream_is_never_asked() -> None:
    wire = Wire(load_device("stream-st-gs"))
    wire.tick()
    wire.answer(5.0)
    wire.tick(1.0)
    assert wire.asked == []
    assert wire.exchange.is_stream
    assert wire.samples[0].force_n == pytest.approx(5.0, abs=0.05)


def test_the_next_question_follows_the_answer_at_once(wire: Wire) -> None:
    assert not wire.exchange.is_stream
    wire.tick()
    for count in range(1, 6):
        assert wire.asked == [b"W?\r\n"] * count
        wire.answer(count)
    assert [sample.force_n for sample in wire.samples] == [1, 2, 3, 4, 5]
    assert wire.samples[-1].time_s == wire.now_s


@pytest.mark.parametrize("is_tick_first", [True, False])
def test_what_has_waited_for_a_loop_that_stood_still_is_as_old_as_it_may_be(is_tick_first: bool) -> None:
    """A cell that had fallen silent meanwhile looked as if it spoke: its last words seemed to have come just then."""
    wire = Wire(load_device("stream-st-gs"))
    wire.tick()
    wire.answer(5.0)
    began_s = wire.now_s
    wire.now_s += 0.5
    steps = [lambda: wire.answer(6.0, 0.0), lambda: wire.tick(0.0)]
    for step in steps[::-1] if is_tick_first else steps:
        step()
    wire.tick()
    wire.answer(7.0, 0.005)
    assert [sample.time_s for sample in wire.samples] == [began_s, began_s, wire.now_s]


def test_there_is_never_a_second_question_before_the_answer_or_its_time(wire: Wire) -> None:
    wire.tick()
    for _ in range(9):
        wire.tick(0.01)
    assert len(wire.asked) == 1
    wire.tick(0.02)
    assert len(wire.asked) == 2


def test_a_faster_wire_waits_for_the_devices_own_rate() -> None:
    wire = Wire(replace(POLLED, read_force=replace(READING, rate_hz=10.0)))
    wire.tick()
    wire.answer(after_s=0.001)
    wire.tick(0.05)
    assert len(wire.asked) == 1
    wire.tick(0.05)
    assert len(wire.asked) == 2


def test_an_answer_that_comes_late_is_a_reading_and_brings_no_third_question(wire: Wire) -> None:
    """On a bus of two wires it would meet the answer to the second."""
    wire.tick()
    wire.tick(TIMEOUT_S + 0.01)
    assert len(wire.asked) == 2
    wire.answer(3.0)
    assert len(wire.samples) == 1
    wire.tick(0.01)
    assert len(wire.asked) == 2
    wire.answer(4.0)
    assert (len(wire.samples), len(wire.asked)) == (2, 3)


def test_a_reset_asks_no_second_question_of_the_right_cell(wire: Wire) -> None:
    wire.tick()
    wire.exchange.clear_faults()
    wire.tick()
    assert wire.asked == [b"W?\r\n"]


@pytest.mark.parametrize("late_s", [None, TIMEOUT_S + 0.005, TIMEOUT_S + 0.05], ids=["lost", "late", "very late"])
def test_after_an_answer_that_is_lost_or_late_the_line_is_back_at_its_rate(wire: Wire, late_s: float | None) -> None:
    """The device answers each question once. It was asked once in a reply's time for ever, as one of the schedules showed."""
    due: list[float] = []
    for step in range(1000):
        asked = len(wire.asked)
        wire.tick(0.001)
        if due and due[0] <= wire.now_s + 1e-9:
            due.pop(0)
            wire.answer(after_s=0.0)
        if len(wire.asked) > asked:
            due += [wire.now_s + ROUND_TRIP_S] if step else [] if late_s is None else [wire.now_s + late_s]
            due.sort()
        if step == 500:
            before = len(wire.asked)
    assert len(wire.asked) - before == pytest.approx(500 * 0.001 / ROUND_TRIP_S, abs=2)


def test_half_an_answer_from_before_a_reopening_is_no_part_of_the_next(wire: Wire) -> None:
    wire.tick()
    wire.exchange.receive(b"W +0001", wire.now_s)
    wire.exchange.reset()
    wire.tick()
    wire.answer(2.0)
    assert [sample.force_n for sample in wire.samples] == [2.0]


def test_behind_a_plug_may_be_another_cell() -> None:
    """What it is, is asked anew after each opening, and no reading of a cell is taken before it has said so."""
    profile = replace(POLLED, identity=Identity(ask="ID?", answer="ID {model:s}", models=("A1",)))
    wire = Wire(profile)
    for said, fault in (
        (b"ID A1\r\n", FaultCode.NONE),
        (b"ID B2\r\n", FaultCode.WRONG_DEVICE),
        (b"ID A1\r\n", FaultCode.NONE),
    ):
        wire.exchange.receive(b"ID B", wire.now_s)
        wire.exchange.reset()
        wire.asked.clear()
        wire.tick()
        assert wire.asked == [b"ID?\r\n"]
        before = len(wire.samples)
        wire.answer()
        assert len(wire.samples) == before
        wire.exchange.receive(said, wire.now_s)
        assert wire.exchange.identity.fault is fault
        wire.tick(1.0)
        assert (wire.asked[-1] == b"W?\r\n") is (fault is FaultCode.NONE)


@pytest.mark.parametrize(("away_s", "is_asked"), [(0.3, False), (0.8, True), (5.0, True)])
def test_behind_a_silence_may_be_another_cell_too(away_s: float, is_asked: bool) -> None:
    """On a bus the adapter stays where it is: one that shows another unit or range was read as the one before."""
    wire = Wire(replace(POLLED, identity=Identity(ask="ID?", answer="ID {model:s}", models=("A1",))))
    wire.tick()
    wire.exchange.receive(b"ID A1\r\n", wire.now_s)
    wire.answer()
    for _ in range(round(away_s / 0.01)):
        wire.tick()
    assert (wire.asked[-1] == b"ID?\r\n") is is_asked
    wire.answer()
    assert (len(wire.samples) == 1) is is_asked
    wire.exchange.receive(b"ID B2\r\n", wire.now_s)
    assert (wire.exchange.identity.fault is FaultCode.WRONG_DEVICE) is is_asked
    wire.exchange.clear_faults()
    wire.tick()
    wire.exchange.receive(b"ID A1\r\n", wire.now_s)
    wire.answer()
    assert wire.samples and wire.exchange.identity.fault is FaultCode.NONE


def test_a_cell_that_does_not_say_what_it_is_is_told_as_such() -> None:
    """No reading is taken of it: power and wires alone were blamed, and stream mode, of one that answers readings."""
    wire = Wire(replace(POLLED, identity=Identity(ask="ID?", answer="ID {model:s}", models=("A1",))))
    assert wire.exchange.says(wire.now_s) == ""
    for _ in range(30):
        wire.tick()
    assert set(wire.asked) == {b"ID?\r\n"}
    assert "it does not say what it is" in wire.exchange.says(wire.now_s)
    wire.hear(b"ID A1\r\n")
    assert wire.exchange.says(wire.now_s) == ""


def test_questions_are_counted_and_a_stream_has_none(wire: Wire) -> None:
    """What the metrics call asked: the answered, the lost and the one that is out."""
    for _ in range(3):
        wire.tick()
        wire.answer()
    wire.tick(2.0 * TIMEOUT_S)
    assert wire.exchange.counts.asked == len(wire.asked) == 5
    stream = Wire(load_device("stream-st-gs"))
    stream.tick()
    stream.answer()
    assert stream.exchange.counts.asked == 0


def test_noise_frees_no_wire(wire: Wire) -> None:
    """A second question would garble the answer that is on its way."""
    wire.tick()
    messages = wire.exchange.receive(b"#?#\r\n", wire.now_s + 0.001)
    assert [type(one) for one in messages] == [Garbage]
    wire.tick(0.01)
    assert len(wire.asked) == 1


def test_a_cell_that_answers_at_once_is_asked_no_more_often_than_the_loop_can_use(wire: Wire) -> None:
    wire.tick()
    for _ in range(1000):
        wire.answer(after_s=0.0005)
        wire.tick(0.0005)
    assert 245 <= len(wire.asked) <= 251


def test_a_bus_has_its_silence_between_an_answer_and_the_next_question() -> None:
    """Without it the cell does not see where a frame begins."""
    wire = Wire(load_device("laumas-tlb"))
    gap_s = cell_host(load_device("laumas-tlb")).gap_s
    assert gap_s > 0.001
    wire.tick()
    wire.answer(after_s=0.1)
    wire.tick(0.9 * gap_s)
    assert len(wire.asked) == 1
    wire.tick(0.2 * gap_s)
    assert len(wire.asked) == 2


def test_a_slow_cell_whose_answer_is_lost_is_asked_again_at_once() -> None:
    wire = Wire(replace(POLLED, read_force=replace(READING, rate_hz=1.0)))
    wire.tick()
    wire.tick(TIMEOUT_S + 0.01)
    assert len(wire.asked) == 2


def test_half_an_answer_from_before_a_time_out_is_no_part_of_the_next(wire: Wire) -> None:
    wire.tick()
    wire.exchange.receive(b"W +0001", wire.now_s)
    wire.tick(TIMEOUT_S + 0.01)
    wire.answer(2.0)
    assert [sample.force_n for sample in wire.samples] == [2.0]


@pytest.mark.parametrize("rest", [b"2.100\r", b"", b".100\r"])
def test_the_rest_of_an_answer_whose_time_ran_out_in_its_middle_is_no_reading(rest: bytes) -> None:
    """The rest of +00032.100 was a reading of 2.1, where nothing marks the beginning of a line."""
    profile = load_device("mantracourt-dsc")
    wire = Wire(replace(profile, read_force=replace(profile.reading, unit="N")))
    wire.tick()
    wire.exchange.receive(b"+00032.100\r"[: -len(rest) or -1], wire.now_s)
    wire.tick(TIMEOUT_S + 0.01)
    wire.hear(rest)
    for _ in range(3):
        wire.answer(32.1)
        wire.tick(TIMEOUT_S + 0.01)
    assert {sample.force_n for sample in wire.samples} == {32.1}


def test_what_a_cell_is_is_an_answer_like_any_other(wire: Wire) -> None:
    """It is counted, noise before it is told, and no time-out of it slows the readings down."""
    wire = Wire(replace(POLLED, identity=Identity(ask="ID?", answer="ID {model:s}", models=("A1",))))
    wire.tick()
    wire.tick(TIMEOUT_S + 0.01)
    assert wire.asked == 2 * [b"ID?\r\n"]
    assert [type(one) for one in wire.exchange.receive(b"#?#\r\n", wire.now_s)] == [Garbage]
    wire.exchange.receive(b"ID A1\r\n", wire.now_s)
    assert (wire.exchange.counts.asked, wire.exchange.counts.heard) == (3, 1)
    wire.tick(0.0)
    wire.answer()
    wire.tick(0.0)
    assert wire.asked[2:] == 2 * [b"W?\r\n"]
