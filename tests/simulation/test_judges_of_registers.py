"""Those who judge registers: a word of the command that nobody has written, what is done more often than asked for, a float
that is not what its word is."""

import struct
from collections.abc import Sequence
from math import inf, nan

import pytest

from tests.simulation.judges.command_witness import WORDS, CommandWitness, Counted
from tests.simulation.judges.observer import STATUS_WORDS, Bounds, Observer
from tests.simulation.judges.status_witness import SCALES, StatusWitness
from tests.simulation.judges.target_witness import TargetWitness
from tests.simulation.masters.spelling import floats_pdu, write_one_pdu, write_pdu

BOUNDS = Bounds(8.5, 40.0, 0.125, 0.1, 0.2, 0.05, output_timeout_s=0.2)


@pytest.mark.parametrize(
    ("pdu", "later", "is_seen"),
    [
        (write_pdu(7, 300), 300, False),
        (write_pdu(7, 300), 301, True),
        (write_pdu(6, 0, 300, 5), 300, False),
        (floats_pdu(214, 3.0, is_swapped=False), 300, False),
        (write_one_pdu(8, 300), 300, True),
    ],
)
def test_a_word_of_the_command_that_nobody_has_written_is_seen(pdu: bytes, later: int, is_seen: bool) -> None:
    observer = Observer(BOUNDS)
    witness = CommandWitness(observer)
    witness.note(bytes(2 * WORDS), 1.0)
    witness.note_write(pdu, 1.1)
    for number in range(6):
        witness.note(struct.pack(f">{WORDS}H", *[0] * 7, later, *[0] * 5), 1.2 + 0.1 * number)
    assert [line.partition(" at ")[0] for line in observer.broken] == ["I7"] * is_seen


def test_a_setpoint_is_lowered_by_a_calibration_and_never_raised() -> None:
    observer = Observer(BOUNDS)
    witness = CommandWitness(observer)
    witness.note_write(write_one_pdu(1, 5000), 1.0)
    for number, counts in enumerate((5000, 4000, 4000, 4500, 0, 0, 0)):
        witness.note(struct.pack(f">{WORDS}H", 1, counts, *[0] * 11), 1.0 + 2.0 * number)
    assert len(observer.broken) == 1


@pytest.mark.parametrize(
    ("asked", "done", "is_seen"),
    [
        ((True, True), 2, False),
        ((True, True), 1, True),
        ((True, True), 3, True),
        ((True, False), 1, False),
        ((), 1, True),
    ],
)
def test_what_is_done_more_or_less_often_than_asked_for_is_seen(
    asked: tuple[bool, ...], done: int, is_seen: bool
) -> None:
    counted = Counted("a zero was taken")
    for is_sure in asked:
        counted.note_asked(is_sure=is_sure)
    for _ in range(done):
        counted.note_done()
    assert bool(counted.judge()) is is_seen


@pytest.mark.parametrize(
    ("place", "word", "number", "is_seen"),
    [
        (2, 1234, 12.34, False),
        (2, 1234, 1234.0, True),
        (2, 0x8000, nan, False),
        (2, 0, nan, True),
        (2, 65526, -0.1, False),
    ],
)
def test_a_float_that_is_not_what_its_word_is_is_seen(place: int, word: int, number: float, is_seen: bool) -> None:
    observer = Observer(BOUNDS)
    witness = StatusWitness(observer, lambda: inf)
    words, numbers = [0] * STATUS_WORDS, [0.0] * len(SCALES)
    words[place], numbers[place] = word, number
    witness.note(struct.pack(f">{STATUS_WORDS}H", *words), 1.0)
    witness.note_floats(struct.pack(f">{len(SCALES)}f", *numbers), 1.0)
    assert bool(observer.broken) is is_seen


def look_at_target(witness: TargetWitness, seconds: float, begun_s: float = 1000.0, **registers: int) -> None:
    places = {"word": 0, "state": 1, "measured": 2, "accepted": 4, "applied": 5, "warnings": 11}
    words = [0] * STATUS_WORDS
    for name, value in ({"state": 3, "word": 1, "accepted": 2000, "applied": 2000} | registers).items():
        words[places[name]] = value
    for number in range(round(10 * seconds)):
        witness.note(struct.pack(f">{STATUS_WORDS}h", *words), begun_s + 0.1 * number)


@pytest.mark.parametrize(
    ("registers", "seconds", "is_seen"),
    [
        ({"measured": 1700}, 4.5, True),
        ({"measured": 1700}, 3.0, False),
        ({"measured": 1700, "warnings": 2}, 4.5, False),
        ({"measured": 1700, "word": 513}, 4.5, False),
        ({"measured": 0, "applied": 300, "state": 1}, 4.5, True),
        ({"measured": 1850}, 4.5, False),
        ({"measured": -2000, "word": 9}, 4.5, False),
        ({"measured": 1750, "word": 9}, 1.0, True),
        ({"measured": 1850, "word": 9}, 1.0, False),
        ({"measured": 1990}, 2.0, True),
        ({"measured": 1990, "state": 2}, 2.0, False),
    ],
)
def test_a_target_that_is_missed_without_a_word_and_a_false_band_are_seen(
    registers: dict[str, int], seconds: float, is_seen: bool
) -> None:
    observer = Observer(BOUNDS)
    look_at_target(TargetWitness(observer), seconds, **registers)
    assert {line.partition(" at ")[0] for line in observer.broken} == ({"target"} if is_seen else set())


@pytest.mark.parametrize(("masters", "address", "is_seen"), [(1, 1, True), (2, 1, False), (1, 0, False)])
def test_two_masters_who_take_a_target_from_each_other_or_let_it_go_have_none(
    masters: int, address: int, is_seen: bool
) -> None:
    """The word is one without enable; of a master on a bus nobody knows its name."""
    observer = Observer(BOUNDS)
    witness = TargetWitness(observer)
    for number in range(9):
        witness.note_write(f"10.0.0.{1 + number % masters}", write_pdu(address, 2000), 1000.0 + 0.5 * number)
        look_at_target(witness, 0.5, 1000.0 + 0.5 * number, measured=1700)
    assert bool(observer.broken) is is_seen


@pytest.mark.parametrize(("weights", "is_seen"), [((0,) * 9, True), ((300,) * 9, True), (range(0, 900, 100), False)])
def test_a_force_that_is_missed_by_another_weight_than_before_is_missed_anew(
    weights: Sequence[int], is_seen: bool
) -> None:
    """Not where the same one is told again and again."""
    observer = Observer(BOUNDS)
    witness = TargetWitness(observer)
    for number, weight in enumerate(weights):
        witness.note_write("10.0.0.1", write_pdu(9, weight), 1000.0 + 0.5 * number)
        look_at_target(witness, 0.5, 1000.0 + 0.5 * number, measured=1700)
    assert bool(observer.broken) is is_seen


@pytest.mark.parametrize(
    ("band", "registers", "seconds", "is_seen"),
    [
        (400, {"measured": 1700}, 4.5, False),
        (400, {"measured": 1400}, 4.5, True),
        (400, {"measured": 1700, "word": 9}, 1.0, False),
        (400, {"measured": 1400, "word": 9}, 1.0, True),
        (0, {"measured": 1700, "word": 9}, 1.0, True),
    ],
)
def test_a_target_is_judged_by_the_band_that_its_master_has_written(
    band: int, registers: dict[str, int], seconds: float, is_seen: bool
) -> None:
    """Not by the one before, as long as nobody has read which one counts."""
    observer = Observer(BOUNDS)
    witness = TargetWitness(observer)
    witness.note_write("10.0.0.1", write_pdu(11, band), 999.0)
    if band:
        look_at_target(witness, seconds, 990.0, **registers)
        assert not observer.broken
    witness.note_band(band, 0, 999.5)
    look_at_target(witness, seconds, **registers)
    assert bool(observer.broken) is is_seen


@pytest.mark.parametrize(("awoken_s", "is_seen"), [(1.08, False), (1.25, True), (0.9, True)])
def test_a_reading_may_be_dated_behind_the_standstill_that_it_waited_through(awoken_s: float, is_seen: bool) -> None:
    observer = Observer(BOUNDS)
    observer.history.awoken.append(awoken_s)
    witness = StatusWitness(observer, lambda: 1.0)
    for tenths in range(13, 17):
        words = [0] * STATUS_WORDS
        words[12], words[16] = 100 * (tenths - 10) - 150, 0x0A00
        witness.note(struct.pack(f">{STATUS_WORDS}H", *words), 0.1 * tenths)
    assert bool(observer.broken) is is_seen


@pytest.mark.parametrize("word", [16, 1])
def test_a_status_bit_that_the_state_does_not_have_is_seen(word: int) -> None:
    observer = Observer(BOUNDS)
    witness = StatusWitness(observer, lambda: 1.0)
    for tenths in range(13, 21):
        witness.note(struct.pack(f">{STATUS_WORDS}H", word, *[0] * (STATUS_WORDS - 1)), 0.1 * tenths)
    assert any(line.endswith(f"status word {word:#x} in state 0") for line in observer.broken), observer.broken
