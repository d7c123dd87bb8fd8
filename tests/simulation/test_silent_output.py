"""Those who judge what is done while the output is silent, or away: a zero that is taken of a force, a stop that waits, and a
sentence that is half on the wire when the rest of it is dropped."""

from collections.abc import Iterator
from dataclasses import replace
from math import inf

import pytest

from tests.service.rigs import demo
from tests.simulation.draws.sequences import draw_sequences
from tests.simulation.judges.heard import LineObserver, RtuObserver
from tests.simulation.judges.observer import Bounds, Observer
from tests.simulation.judges.zero_witness import MOST_N, UNKNOWN_S, ZeroWitness
from tests.simulation.kernel.cables import CABLES
from tests.simulation.kernel.virtual_time import VirtualClock, VirtualLoop
from tests.simulation.masters.spelling import tells_weight, write_one_pdu, write_pdu
from tests.simulation.surroundings import Surroundings

BOUNDS = Bounds(8.5, 40.0, 0.125, 0.1, 0.2, 0.05, output_timeout_s=0.5, reply_timeout_s=0.1)


@pytest.mark.parametrize(
    ("pressing_n", "names", "falsely_s", "is_seen"),
    [
        (30.0, (), -inf, True),
        (30.0, ("output.silent",), -inf, True),
        (0.9 * MOST_N, (), -inf, False),
        (30.0, ("leak",), -inf, False),
        (30.0, (), 9.5, False),
    ],
)
def test_a_zero_that_is_taken_of_a_force_is_seen(
    pressing_n: float, names: tuple[str, ...], falsely_s: float, is_seen: bool
) -> None:
    observer = Observer(BOUNDS)
    witness = ZeroWitness(observer, lambda: pressing_n, lambda: falsely_s)
    witness.note_settings(names, 9.0)
    witness.note_zero(10.0)
    assert [line.partition(" at ")[0] for line in observer.broken] == ["zero"] * is_seen
    witness.note_zero(9.5 + 1.1 * UNKNOWN_S)
    assert bool(observer.broken) is (pressing_n > MOST_N), "sooner or later the gateway must know"


@pytest.mark.parametrize(("silent_s", "is_broken"), [(None, True), (0.9, False)])
def test_a_stop_behind_a_question_that_nobody_answers_comes_a_reply_s_time_later(
    silent_s: float | None, is_broken: bool
) -> None:
    observer = Observer(replace(BOUNDS, lease_s=inf))
    observer.note_accepted(1, 0.5)
    observer.hear(b"SET 0\r\nSET 40\r\n", 0.5)
    observer.answers_lost_s, observer.cell_heard_s = silent_s, 1.2
    observer.note_accepted(0, 1.0)
    observer.look(1.2)
    assert [line.partition(" at ")[0] for line in observer.broken] == ["I4"] * is_broken
    observer.look(1.3)
    assert observer.broken


@pytest.mark.parametrize(
    ("pdu", "is_told"),
    [
        (write_one_pdu(9, 0), True),
        (write_one_pdu(6, 900), True),
        (write_pdu(0, 1, 1200, 0, 0, 1), False),
        (write_pdu(0, 1, 1200, 0, 0, 1, 0, 0), True),
        (write_pdu(212, 0, 0), True),
        (write_pdu(10, 7), False),
    ],
)
def test_a_write_that_tells_a_weight_or_a_tilt_is_told_from_others(pdu: bytes, is_told: bool) -> None:
    assert tells_weight(pdu) is is_told


def test_few_schedules_have_a_sequence_and_those_that_have_have_it_in_order() -> None:
    drawn = [list(draw_sequences(seed)) for seed in range(400)]
    assert 40 < sum(map(bool, drawn)) < 100
    assert all(events == sorted(events, key=lambda event: event.at_s) for events in drawn)
    assert {event.what for events in drawn for event in events} >= {"tare", "pull", "output-cut", "ask", "say"}


RTU_0_V, RTU_2_V = bytes.fromhex("010600000000 89ca"), bytes.fromhex("0106000007d0 8a66")


@pytest.fixture
def outside() -> Iterator[VirtualLoop]:
    loop = VirtualLoop(VirtualClock(), has_tasks=False)
    yield loop
    loop.close()


@pytest.mark.parametrize(
    ("kind", "sentence", "next_one", "settings"),
    [
        (Observer, b"SET 205\r\n", b"SET 0\r\n", 1),
        (LineObserver, b"#0102.000\r", b"#0100.000\r", 1),
        (RtuObserver, RTU_2_V, RTU_0_V, 2),
    ],
)
@pytest.mark.parametrize("sent", [1, 3, 7])
def test_what_is_left_of_a_dropped_sentence_may_stand_before_the_next_one_and_nothing_else(
    outside: VirtualLoop, kind: type[Observer], sentence: bytes, next_one: bytes, settings: int, sent: int
) -> None:
    """A device that is told lines does not understand the one behind it; by a CRC it is found."""
    observer = kind(BOUNDS)
    Surroundings(demo(), outside, observer, None)
    cable = CABLES["output"]

    def complains(data: bytes, for_s: float = 1.0) -> bool:
        before = len(observer.broken)
        cable.send_to_device(data)
        outside.clock.run_until(outside.time() + for_s)
        return len(observer.broken) > before

    assert not complains(next_one), "the first may stand behind anything"
    assert not complains(sentence, (sent - 0.5) * cable._character_s)
    cable.drop_unsent()
    assert not complains(next_one) and observer.settings == settings
    assert not complains(next_one) and observer.settings == settings + 1
    assert complains(sentence[:sent] + next_one), "nothing was dropped"
    assert not complains(sentence, (sent - 0.5) * cable._character_s)
    cable.drop_unsent()
    assert complains(b"?" + next_one), "what follows it is garbled"
