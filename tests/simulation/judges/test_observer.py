"""The observer beside the gateway sees each law broken by itself, and nothing a moment before: a schedule that finds nothing
is worth as much as its observer sees."""

import struct
from dataclasses import replace

import pytest

from tests.simulation.judges.heard import LineObserver, RtuObserver, crc16
from tests.simulation.judges.observer import DOWN_S, FAULT, GRACE_S, STATUS_WORDS, Bounds, Observer

BOUNDS = Bounds(8.5, 40.0, 0.125, 0.1, 0.2, 0.01, output_timeout_s=0.25, reply_timeout_s=0.05)
LATE_S = GRACE_S + 2.0 * BOUNDS.period_s
PRESSES_S = 10.0
OFF, HOLDING = 0, 3


def observer_of() -> Observer:
    """Some volts have stood for long, by a master's enable, and everything is heard."""
    observer = Observer(BOUNDS)
    observer.hear(b"SET 0\r\nSET 0\r\n", 0.1)
    observer.hear(b"SET 400\r\n", 5.0)
    observer.note_accepted(1, 4.9)
    hear_all(observer, PRESSES_S)
    assert not observer.broken
    return observer


def hear_all(observer: Observer, now_s: float) -> None:
    observer.cell_heard_s = observer.write_s = now_s


def broken_laws(observer: Observer) -> list[str]:
    return [line.partition(" at ")[0] for line in observer.broken]


def told(state: int, fault: int) -> bytes:
    words = [0] * STATUS_WORDS
    words[1], words[10] = state, fault
    return b"\x03\x28" + struct.pack(f">{STATUS_WORDS}H", *words)


@pytest.mark.parametrize(
    ("setting", "laws"),
    [
        (b"SET 869\r\n", []),
        (b"SET 900\r\n", ["I1"]),
        (b"SET 100\r\n", []),
        (b"SET 90\r\n", ["I1"]),
    ],
)
def test_a_voltage_outside_the_range_is_seen_on_either_side(setting: bytes, laws: list[str]) -> None:
    observer = observer_of()
    observer.bounds = replace(BOUNDS, voltage_min_v=0.98)
    observer.hear(setting, 20.0)
    assert broken_laws(observer) == laws


@pytest.mark.parametrize(("after_s", "is_seen"), [(0.01, True), (0.04, False)])
def test_a_rise_that_is_steeper_than_the_slope_is_seen(after_s: float, is_seen: bool) -> None:
    observer = observer_of()
    observer.hear(b"SET 450\r\n", 20.0)
    observer.hear(b"SET 650\r\n", 20.0 + after_s)
    assert broken_laws(observer) == ["I2"] * is_seen
    observer.hear(b"SET 0\r\n", 20.1)
    assert broken_laws(observer) == ["I2"] * is_seen, "less is no rise"


def test_what_is_no_sentence_is_seen_but_where_its_sender_was_cut_off() -> None:
    observer = observer_of()
    observer.hear(b"MON\r\nSET 41", 20.0)
    observer.hear(b"0\r\n", 20.1)
    assert broken_laws(observer) == []
    observer.hear(b"SE 410\r\n", 20.2)
    assert broken_laws(observer) == ["I7"]
    observer.note_cut(20.3)
    observer.hear(b"SESET 0\r\nSE 0\r\n", 20.4)
    assert broken_laws(observer) == ["I7", "I7"], "behind the first sentence all are whole again"


@pytest.mark.parametrize(
    ("stands", "is_mended", "laws"), [(0, True, []), (0, False, ["I6"]), (410, True, ["I6"]), (410, False, ["I6"])]
)
def test_the_safe_voltage_comes_first_behind_a_cut_but_where_it_stands_already(
    stands: int, is_mended: bool, laws: list[str]
) -> None:
    observer = observer_of()
    observer.hear(b"SET %d\r\n" % stands, 20.0)
    observer.note_cut(20.1)
    if is_mended:
        observer.note_mended()
    observer.hear(b"SET 420\r\n", 25.0)
    assert broken_laws(observer) == laws


@pytest.mark.parametrize(
    ("law", "what", "bound_s"),
    [
        ("I3 cell", "cell_lost_s", BOUNDS.sample_timeout_s),
        ("I3 cell unheard", "cell_heard_s", BOUNDS.sample_timeout_s),
        ("I3 over-force", "over_s", 0.0),
        ("I3 output", "answers_lost_s", BOUNDS.output_timeout_s + BOUNDS.reply_timeout_s),
        ("I3 control", "control_lost_s", BOUNDS.stall_s),
        ("I3 master", "write_s", BOUNDS.lease_s),
        ("I4", "disabled_s", 0.0),
    ],
)
def test_a_voltage_that_stands_behind_a_loss_is_seen_once_its_time_is_over(law: str, what: str, bound_s: float) -> None:
    observer = observer_of()
    for after_s, laws in ((bound_s + LATE_S - 0.005, []), (bound_s + LATE_S + 0.005, [law])):
        hear_all(observer, PRESSES_S + after_s)
        setattr(observer, what, PRESSES_S)
        observer.look(PRESSES_S + after_s)
        assert broken_laws(observer) == laws
    observer.hear(b"SET 0\r\n", 11.0)
    observer.look(12.0)
    assert broken_laws(observer) == [law], "nothing stands any more"


def test_a_run_s_end_takes_a_ramp_down_and_no_longer() -> None:
    observer = observer_of()
    observer.note_accepted(32, PRESSES_S)
    observer.note_accepted(0, 11.0)
    for after_s, laws in ((DOWN_S - 0.1, []), (DOWN_S + 0.1, ["I4"])):
        hear_all(observer, 11.0 + after_s)
        observer.look(11.0 + after_s)
        assert broken_laws(observer) == laws


@pytest.mark.parametrize(
    ("looks", "laws"),
    [
        (((FAULT, 3), (FAULT, 3)), []),
        (((FAULT, 0),), ["I11"]),
        (((FAULT, 3), (FAULT, 7)), ["I11"]),
        (((FAULT, 3), (OFF, 0)), ["I5"]),
        (((HOLDING, 0), (FAULT, 3)), []),
    ],
)
def test_a_fault_that_goes_by_itself_or_becomes_another_is_seen(
    looks: tuple[tuple[int, int], ...], laws: list[str]
) -> None:
    observer = Observer(BOUNDS)
    for number, (state, fault) in enumerate(looks):
        observer.note_status(told(state, fault), 1.0 + number)
    assert broken_laws(observer) == laws


def test_behind_a_reset_a_fault_may_go() -> None:
    observer = Observer(BOUNDS)
    observer.note_status(told(FAULT, 3), 1.0)
    observer.note_accepted(2, 1.05)
    observer.note_status(told(OFF, 0), 2.0)
    assert broken_laws(observer) == []


@pytest.mark.parametrize(
    ("said", "readings", "is_seen"),
    [
        (b"OL,GS,        kg\r\n", 3, True),
        (b"OL,GS,        kg\r\n", 2, False),
        (b"ST,GS,+0009.00kg\r\n", 3, True),
        (b"ST,GS,+0009.00 N\r\n", 3, False),
    ],
)
def test_an_over_force_that_its_cell_says_is_counted_in_the_unit_of_its_frame(
    said: bytes, readings: int, is_seen: bool
) -> None:
    observer = observer_of()
    for number in range(readings):
        observer.hear_cell(said, PRESSES_S + 0.001 * number)
    hear_all(observer, PRESSES_S + 0.1)
    observer.look(PRESSES_S + 0.1)
    assert broken_laws(observer) == ["I3 over-force"] * is_seen


def framed(body: bytes) -> bytes:
    return body + crc16(body).to_bytes(2, "little")


TOLD = framed(b"\x01\x06\x00\x00\x00\x00")


@pytest.mark.parametrize(
    ("observer", "heard", "count"),
    [
        (LineObserver(BOUNDS), b"#0100.000\r#0100.000\r", 0),
        (LineObserver(BOUNDS), b"#0100.000\rhello\r", 1),
        (RtuObserver(BOUNDS), TOLD + framed(b"\x01\x03\x00\x00\x00\x01"), 0),
        (RtuObserver(BOUNDS), TOLD + framed(b"\x01\x10\x00\x00\x00\x01"), 1),
        (RtuObserver(BOUNDS), TOLD + TOLD[:-1] + b"\x00", 1),
    ],
)
def test_what_no_output_device_understands_is_seen(observer: Observer, heard: bytes, count: int) -> None:
    observer.hear(heard, 1.0)
    assert len(observer.broken) == count, observer.broken
