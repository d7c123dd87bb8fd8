"""Those who judge what masters do and are told: a heartbeat that stands, a load cell that lies, a stop that is refused, a
reason that is not told, an owner who has lost its lease."""

import struct
from collections.abc import Mapping
from dataclasses import replace
from math import inf, isnan
from typing import Any

import pytest

from tests.simulation.draws.behaviours import STOPS, draw_behaviours
from tests.simulation.draws.event import Event
from tests.simulation.draws.rigs import draw_adapter_s, draw_rig
from tests.simulation.judges.lease_judge import LeaseJudge
from tests.simulation.judges.lying_cell import LyingCell
from tests.simulation.judges.observer import STATUS_WORDS, Bounds, Observer
from tests.simulation.judges.status_witness import StatusWitness
from tests.simulation.masters.spelling import (
    BEAT,
    MODE,
    coil_pdu,
    control_of,
    floats_pdu,
    mask_pdu,
    read_and_write_pdu,
    word_of,
    write_one_pdu,
    write_pdu,
)
from tests.simulation.masters.tcp_master import Asked, Master
from tests.simulation.schedule import run_schedule

BOUNDS = Bounds(8.5, 40.0, 0.125, 0.1, 0.2, 0.05, output_timeout_s=0.2)
OWNER = "10.0.0.1"


@pytest.fixture
def observer() -> Observer:
    observer = Observer(BOUNDS)
    observer.hear(b"SET 0\r\nSET 0\r\n", 0.1)
    observer.hear(b"SET 400\r\n", 0.9)
    observer.disabled_s = None
    return observer


def look(witness: StatusWitness, at_s: float, **registers: int) -> None:
    places = {
        "status_word": 0,
        "state": 1,
        "accepted": 4,
        "limited": 9,
        "fault": 10,
        "warnings": 11,
        "beat": 14,
        "owner": 17,
    }
    words = [0] * STATUS_WORDS
    words[16] = 0x0A00
    for name, value in registers.items():
        words[places[name]] = value
    words[16] = words[16] if words[17] else 0
    witness.note(struct.pack(f">{STATUS_WORDS}H", *words), at_s)


@pytest.mark.parametrize(
    ("pdu", "mode", "beat"),
    [
        (write_pdu(0, 1, 1200, 0, 1, 7), 1.0, 7.0),
        (write_pdu(0, 1, 1200), None, None),
        (write_one_pdu(4, 65535), None, 65535.0),
        (read_and_write_pdu(100, 2, 3, 0, 8), 0.0, 8.0),
        (floats_pdu(200, 1.0, 12.0, 0.0, 1.0, 9.0, is_swapped=False), 1.0, 9.0),
        (floats_pdu(300, 1.0, 12.0, 0.0, 0.0, 9.0, is_swapped=True), 0.0, 9.0),
    ],
)
def test_mode_and_heartbeat_are_read_from_every_spelling(pdu: bytes, mode: float | None, beat: float | None) -> None:
    assert (word_of(pdu, MODE), word_of(pdu, BEAT)) == (mode, beat)


def test_a_masked_heartbeat_may_be_any() -> None:
    masked = word_of(mask_pdu(4, 0, 3), BEAT)
    assert masked is not None and isnan(masked) and word_of(mask_pdu(0, 0, 3), BEAT) is None


@pytest.mark.parametrize(
    ("beats", "is_answered", "is_seen"),
    [((1, 1, 1, 1), True, True), ((1, 2, 3, 4), True, False), ((1, 1, 1, 1), False, False)],
)
def test_a_heartbeat_that_stands_while_frames_flow_renews_nothing(
    observer: Observer, beats: tuple[int, ...], is_answered: bool, is_seen: bool
) -> None:
    judge = LeaseJudge(observer)
    for number, beat in enumerate(beats):
        judge.note_write(write_pdu(0, 1, 1200, 0, 0, beat), 1.0 + 0.15 * number, is_answered=is_answered)
        judge.look(1.0 + 0.15 * number)
    assert [line.partition(" at ")[0] for line in observer.broken] == ["I3 heartbeat"] * is_seen


def test_an_enable_and_a_run_at_the_machine_need_no_heartbeat_yet(observer: Observer) -> None:
    judge = LeaseJudge(observer)
    judge.note_write(write_one_pdu(4, 5), 0.1, is_answered=True)
    observer.disabled_s = 0.9
    judge.note_write(write_pdu(0, 1, 1200, 0, 0, 5), 1.0, is_answered=True)
    observer.disabled_s = None
    judge.look(1.28)
    judge.renew(1.3)
    judge.look(1.5)
    assert observer.broken == []
    judge.look(1.7)
    assert observer.broken


@pytest.mark.parametrize(("hosts", "is_seen"), [("ab", False), ("abab", True)])
def test_a_takeover_begins_a_lease_once_until_its_master_beats(observer: Observer, hosts: str, is_seen: bool) -> None:
    judge = LeaseJudge(observer)
    for number, host in enumerate(hosts):
        judge.note_write(write_pdu(0, 9, 1200), 1.0 + 0.2 * number, is_answered=True, host=host)
        judge.look(1.19 + 0.2 * number)
    assert [line.partition(" at ")[0] for line in observer.broken] == ["I3 heartbeat"] * is_seen


def test_an_enable_begins_a_lease_where_single_bits_have_only_been_cleared_before_and_a_second_does_not(
    observer: Observer,
) -> None:
    judge = LeaseJudge(observer)
    judge.note_write(coil_pdu(1, on=False), 1.0, is_answered=True)
    judge.note_write(write_pdu(0, 1, 1200), 1.5, is_answered=True)
    judge.look(1.7)
    assert observer.broken == []
    judge.note_write(write_pdu(0, 1, 1200), 1.7, is_answered=True)
    judge.look(2.0)
    assert observer.broken


def test_a_lease_that_frames_with_the_same_heartbeat_renew_is_seen_in_a_schedule(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    events = [Event(0.2, "worker", "take", (20.0,)), Event(0.8, "worker", "hang")]
    assert not run_schedule(4, events, 2.0).broken
    monkeypatch.setattr(
        "gateway.control.supervision.lease.Lease.observe",
        lambda lease, now_s, *heard: setattr(lease, "_changed_s", now_s),
    )
    assert "I3 heartbeat" in {line.partition(" at ")[0] for line in run_schedule(4, events, 2.0).broken}


@pytest.mark.parametrize(
    ("settings", "law"),
    [
        ({"cell.frozen": True}, "I3 frozen"),
        ({"cell.inverted": True}, "I3 false cell"),
        ({"cell.scale": 5.0}, "I3 false cell"),
        ({"cell.scale": 0.1}, "I3 false cell"),
        ({"cell.scale": 1.5}, ""),
        ({"leak": 1.0}, ""),
        ({"cell.frozen": True, "contact.off": True}, ""),
    ],
)
def test_a_cell_that_lies_and_is_believed_is_seen(observer: Observer, settings: Mapping[str, Any], law: str) -> None:
    judge = LyingCell(observer)
    observer.hear_cell(b"ST,GS,+0002.00kg\r\n", 1.0)
    for number in range(60):
        if number == 10:
            observer.hear(b"SET 800\r\n", 1.5)
        judge.look(settings, 1.0 + 0.05 * number, is_whole=True)
    assert {line.partition(" at ")[0] for line in observer.broken} == ({law} if law else set())


@pytest.mark.parametrize(("fallen_s", "is_seen"), [(0.95, False), (0.2, True)])
def test_a_force_that_need_not_have_left_yet_may_read_the_same(
    observer: Observer, fallen_s: float, is_seen: bool
) -> None:
    judge = LyingCell(observer)
    observer.hear_cell(b"ST,GS,+0005.00kg\r\n", 0.1)
    for setting, at_s in ((b"SET 700\r\n", 0.15), (b"SET 90\r\n", fallen_s)):
        observer.hear(setting, at_s)
    for number in range(60):
        if number == 2:
            observer.hear(b"SET 600\r\n", 1.4)
        judge.look({"cell.frozen": True}, 1.3 + 0.05 * number, is_whole=True)
    assert any(line.startswith("I3 frozen") for line in observer.broken) is is_seen


@pytest.mark.parametrize(("scaled_s", "is_seen"), [(2.55, False), (1.0, True)])
def test_a_frozen_cell_that_is_scaled_anew_has_read_something_else(
    observer: Observer, scaled_s: float, is_seen: bool
) -> None:
    judge = LyingCell(observer)
    observer.hear_cell(b"ST,GS,+0005.00kg\r\n", 1.0)
    for number in range(60):
        at_s = 1.0 + 0.05 * number
        if number == 10:
            observer.hear(b"SET 800\r\n", 1.5)
        scale = {"cell.scale": 3.3} if abs(at_s - scaled_s) < 0.3 else {}
        judge.look({"cell.frozen": True} | scale, at_s, is_whole=True)
    assert any(line.startswith("I3 frozen") for line in observer.broken) is is_seen


@pytest.mark.parametrize("why", ["driving", "run", "disturbed", "safe"])
def test_a_cell_that_nothing_is_held_by_may_lie(observer: Observer, why: str) -> None:
    judge = LyingCell(observer)
    judge.note_mode(float(why == "driving"))
    observer.is_run = why == "run"
    if why == "safe":
        observer.hear(b"SET 0\r\n", 0.95)
    for number in range(60):
        judge.look({"cell.inverted": True}, 1.0 + 0.05 * number, is_whole=why != "disturbed")
    assert observer.broken == []


@pytest.mark.parametrize(
    "registers",
    [
        {"state": 2},
        {"state": 4, "fault": 1, "status_word": 16, "accepted": 1200},
        {"state": 3, "status_word": 1, "warnings": 8},
        {"state": 3, "status_word": 1 | 32},
        {"state": 3, "status_word": 1, "limited": 2},
        {"state": 3, "status_word": 1 | 32, "warnings": 2},
    ],
)
def test_a_bit_of_the_status_word_beside_another_number_is_seen(observer: Observer, registers: dict[str, int]) -> None:
    look(StatusWitness(observer, lambda: inf), 1.0, **registers)
    assert [line.partition(" at ")[0] for line in observer.broken] == ["I10"]


def test_a_refusal_without_a_reason_and_an_enable_that_stands_while_off_are_seen(observer: Observer) -> None:
    witness = StatusWitness(observer, lambda: inf)
    witness.note_refusal(1.0)
    look(witness, 1.0)
    assert observer.broken == []
    look(witness, 1.1)
    witness.note_control_word(1, 1.1)
    assert len(observer.broken) == 2
    witness.forget_owner()
    look(witness, 1.2)
    witness.note_control_word(8, 1.2)
    assert len(observer.broken) == 2


def test_a_heartbeat_that_nobody_has_written_is_seen() -> None:
    observer = Observer(BOUNDS)
    witness = StatusWitness(observer, lambda: inf)
    witness.note_write(OWNER, write_one_pdu(4, 11), 1.0)
    for number, beat in enumerate((11, 11, 12, 12, 12, 12)):
        look(witness, 1.0 + 0.1 * number, beat=beat)
    assert observer.broken == ["I7 at 1.2000: heartbeat 12 is used, which nobody has written"]


def test_an_owner_behind_its_lease_s_end_is_seen_until_somebody_writes_again() -> None:
    observer = Observer(BOUNDS)
    witness = StatusWitness(observer, lambda: inf)
    look(witness, 1.0, state=3, status_word=1, owner=1)
    witness.note_write("", write_one_pdu(4, 0), 1.05)
    for number in range(4):
        look(witness, 1.1 + 0.1 * number, state=4, status_word=16, fault=1, owner=1)
    assert [line.partition(" at ")[0] for line in observer.broken] == []
    look(witness, 1.5, state=3, status_word=1, owner=1)
    for number in range(6):
        look(witness, 1.6 + 0.1 * number, state=4, status_word=16, fault=1, owner=1)
    assert {line.partition(" at ")[0] for line in observer.broken} == {"owner"}


@pytest.mark.parametrize(
    ("pdu", "unit", "code", "is_seen"),
    [
        (write_one_pdu(0, 0), 1, 6, True),
        (write_one_pdu(0, 0), 77, 11, False),
        (write_one_pdu(1, 0), 1, 6, False),
        (write_one_pdu(1, 0), 1, 5, True),
    ],
)
def test_a_stop_that_is_refused_is_seen(pdu: bytes, unit: int, code: int, is_seen: bool) -> None:
    master = Master(OWNER, None, lambda: None, lambda *_: None)  # type: ignore[arg-type]
    master._judge_refusal(Asked(1, pdu, control_of(pdu), unit), code)
    assert bool(master.complaints) is is_seen


def test_a_voltage_below_the_safe_one_counts_as_none() -> None:
    observer = Observer(replace(BOUNDS, safe_v=1.0))
    observer.hear(b"SET 102\r\nSET 102\r\n", 1.0)
    observer.look(1.1)
    assert observer.is_safe and not observer.broken
    observer.hear(b"SET 0\r\n", 1.2)
    observer.look(1.4)
    assert {line.partition(" at ")[0] for line in observer.broken} >= {"I4"}
    dropped = Observer(replace(BOUNDS, safe_v=1.0, voltage_min_v=1.0))
    dropped.hear(b"\r\nSET 0\r\n", 1.0)
    assert [line.partition(" at ")[0] for line in dropped.broken] == ["I1", "I6"]


def test_what_is_rare_is_drawn_and_whole_by_itself() -> None:
    drawn = [list(draw_behaviours(seed)) for seed in range(200)]
    assert 35 < sum(map(bool, drawn)) < 80
    events = [event for one in drawn for event in one]
    assert {"hang", "program", "connect", "ask", "no_process"} <= {event.what for event in events}
    assert {event.data for event in events if event.what == "ask"} <= set(STOPS)
    assert {draw_adapter_s(seed) for seed in range(200)} == {0.0, 0.001, 0.004, 0.016}
    assert {draw_rig(seed).rig.control.limits.safe_voltage_v for seed in range(200)} == {0.0, 0.3, 0.55, 1.0}
