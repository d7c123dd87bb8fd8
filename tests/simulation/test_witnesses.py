"""Those who judge a schedule see what they are there for: each lie of the registers, each mixed set, each right overstepped."""

import struct
from dataclasses import replace
from math import inf

import pytest

from tests.simulation.draws.event import Event
from tests.simulation.draws.rare_events import draw_rare_events
from tests.simulation.judges.observer import STATUS_WORDS, Bounds, Observer
from tests.simulation.judges.status_witness import StatusWitness
from tests.simulation.kernel.edges import Log
from tests.simulation.kernel.virtual_time import VirtualClock
from tests.simulation.masters.integrator import Sets
from tests.simulation.masters.spelling import floats_pdu, mask_pdu, setpoints_of, write_one_pdu, write_pdu
from tests.simulation.masters.tcp_master import Master
from tests.simulation.schedule import run_schedule

BOUNDS = Bounds(8.5, 40.0, 0.125, 0.1, 0.2, 0.05, output_timeout_s=0.2)
OWNER, OTHER = "10.0.0.1", "10.0.0.2"


@pytest.fixture
def observer() -> Observer:
    return Observer(BOUNDS)


def look(witness: StatusWitness, at_s: float, **registers: int) -> None:
    places = {"status_word": 0, "state": 1, "requested": 3, "accepted": 4, "voltage": 6, "age": 12, "owner": 17}
    words = [0] * STATUS_WORDS
    words[16] = 0x0A00
    for name, value in registers.items():
        words[places[name]] = value
    witness.note(struct.pack(f">{STATUS_WORDS}H", *words), at_s)


@pytest.mark.parametrize(
    ("law", "registers"),
    [
        ("I10", {"state": 4}),
        ("I10", {"state": 4, "status_word": 17}),
        ("I10", {"age": 100}),
        ("I10", {"age": 1000, "voltage": 300}),
    ],
)
def test_a_register_that_does_not_say_what_is_is_seen(observer: Observer, law: str, registers: dict[str, int]) -> None:
    witness = StatusWitness(observer, lambda: 1.0)
    for tenths in range(13, 21):
        look(witness, 0.1 * tenths, **registers)
    assert observer.broken and all(line.startswith(law) for line in observer.broken)


@pytest.mark.parametrize(
    ("sentences", "is_over"),
    [
        ((b"OL,GS,        kg\r\n",) * 3, True),
        ((b"ST,GS,+0009.00kg\r\n",) * 3, True),
        ((b"ST,GS,-0090.00 N\r\n",) * 3, True),
        ((b"ST,GS,+0009.00kg\r\n",) * 2, False),
        ((b"OL,GS,        kg\r\n", b"OL,GS,        kg\r\n", b"ST,GS,+0001.00kg\r\n", b"OL,GS,        kg\r\n"), False),
        ((b"OL,GS,        kg\r\n",) * 5 + (b"ST,GS,+0001.00kg\r\n",), False),
        ((b"ST,GS,+0080.00 N\r\n",) * 3, False),
    ],
)
def test_a_voltage_that_stands_behind_over_force_is_seen(
    observer: Observer, sentences: tuple[bytes, ...], is_over: bool
) -> None:
    observer.write_s = observer.cell_heard_s = 1.0
    observer.disabled_s = None
    observer.hear(b"SET 0\r\nSET 1\r\n", 0.9)
    for sentence in sentences:
        observer.hear_cell(sentence, 1.0)
    observer.look(1.13)
    assert not observer.broken
    observer.look(1.16)
    assert [line.partition(" at ")[0] for line in observer.broken] == ["I3 over-force"] * is_over


@pytest.mark.parametrize(("later_s", "is_broken"), [(0.01, False), (0.03, True)])
def test_of_answers_that_come_together_nobody_knows_which_is_the_older(
    observer: Observer, later_s: float, is_broken: bool
) -> None:
    observer.note_accepted(1, 1.0)
    observer.hear(b"SET 0\r\nSET 40\r\n", 1.0)
    observer.note_accepted(0, 1.0 + later_s)
    observer.cell_heard_s = 1.2
    observer.look(1.2)
    assert [line.partition(" at ")[0] for line in observer.broken] == ["I4"] * is_broken


@pytest.mark.parametrize(("reset_s", "is_broken"), [(1.05, False), (0.5, True)])
def test_a_fault_that_goes_without_a_reset_is_seen_however_late_it_is_read(
    observer: Observer, reset_s: float, is_broken: bool
) -> None:
    observer.note_accepted(2, reset_s)
    for state, fault, read_s in ((4, 1, 1.0), (0, 0, 1.5)):  # a standstill between
        words = [0, state, *[0] * 8, fault, *[0] * (STATUS_WORDS - 11)]
        observer.note_status(struct.pack(f">2x{STATUS_WORDS}H", *words), read_s)
    assert [line.partition(" at ")[0] for line in observer.broken] == ["I5"] * is_broken


def test_true_registers_are_left_alone(observer: Observer) -> None:
    witness = StatusWitness(observer, lambda: 1.0)
    witness.note_write(OWNER, write_pdu(0, 1, 1200), 1.85)
    for number in range(20):
        look(witness, 1.9 + 0.1 * number, state=3, status_word=1, age=900 + 100 * number, requested=1200, owner=1)
    assert observer.broken == []


def test_a_voltage_that_is_asked_for_now_may_wait_for_a_late_answer(observer: Observer) -> None:
    witness = StatusWitness(observer, lambda: inf)
    for tenths in range(10, 30):
        look(witness, 0.1 * tenths, voltage=300 if tenths in (20, 21) else 0)
    assert observer.broken == []


def test_a_setpoint_that_nobody_has_written_is_seen(observer: Observer) -> None:
    witness = StatusWitness(observer, lambda: inf)
    witness.note_write(OWNER, write_one_pdu(1, 1100), 1.85)
    for number in range(5):
        look(witness, 1.9 + 0.1 * number, requested=1200)
    assert observer.broken == ["I7 at 1.9000: 12.00 N are requested, which nobody has written"]


@pytest.mark.parametrize(("owner", "requested", "is_broken"), [(2, 4000, False), (1, 4000, True), (2, 4001, True)])
@pytest.mark.parametrize("is_lost", [False, True])
def test_who_takes_over_asks_for_what_is_pursued(
    observer: Observer, owner: int, requested: int, is_broken: bool, is_lost: bool
) -> None:
    """As seed 75077 drew it: a calibration lowered 54.42 N to 40, and somebody else took over by bit 3 alone; and as 236005
    did: that one's lease had ended, and somebody, or that one, enabled what stood."""
    witness = StatusWitness(observer, lambda: inf)
    witness.note_write(OWNER, write_one_pdu(1, 5442), 1.85)
    for number in range(5):
        look(witness, 1.9 + 0.1 * number, requested=5442, accepted=4000, owner=1)
    if is_lost:
        look(witness, 2.4, requested=5442)
    for number in range(6, 11):
        look(witness, 1.9 + 0.1 * number, requested=requested, accepted=0 if is_lost else 4000, owner=owner)
    assert [line.partition(" at ")[0] for line in observer.broken if "requested" in line] == ["I7"] * (
        is_broken and (requested, is_lost) != (4000, True)
    )


@pytest.mark.parametrize(
    ("owner", "writer", "accepted", "is_broken"),
    [(1, OWNER, 3902, False), (1, OWNER, 3901, True), (2, OWNER, 3902, False), (2, OTHER, 3902, True)],
)
def test_what_is_pursued_may_have_become_less_since_the_look_before(
    observer: Observer, owner: int, writer: str, accepted: int, is_broken: bool
) -> None:
    """As seed 250205 drew it: the owner's lease ended on the way to 44.92 N, and another one's heartbeat took over at once; and
    as 254383 did: that one had owned before, and been taken from since the look before."""
    witness = StatusWitness(observer, lambda: inf)
    witness.note_write(writer, write_one_pdu(1, 4492), 1.85)
    look(witness, 1.9, requested=4492, accepted=4492, owner=owner)
    for number in range(1, 5):
        look(witness, 1.9 + 0.1 * number, requested=3902, accepted=accepted, owner=2)
    assert [line.partition(" at ")[0] for line in observer.broken if "requested" in line] == ["I7"] * is_broken


def test_a_gateway_that_begins_has_no_owner(observer: Observer) -> None:
    """As seed 23090 drew it: between two looks it began, another one enabled and was lost, and the first one owned it again."""
    witness = StatusWitness(observer, lambda: inf)
    look(witness, 1.9, owner=1)
    witness.forget_owner()
    witness.note_write(OTHER, write_one_pdu(0, 1), 1.95)
    look(witness, 2.0, owner=1)
    assert observer.broken == []


def test_the_end_of_an_owner_s_run_is_no_command_of_another(observer: Observer) -> None:
    """As seed 41054 drew it: the owner's run stood as enable and its bit, and another's cyclic 1 ended it; its next is one."""
    witness = StatusWitness(observer, lambda: inf)
    look(witness, 1.9, owner=1)
    witness.note_write(OWNER, write_one_pdu(0, 65), 1.93)
    witness.note_write(OTHER, write_one_pdu(0, 1), 1.95)
    look(witness, 2.0, owner=1)
    assert observer.broken == []
    witness.note_write(OTHER, write_one_pdu(0, 1), 2.05)
    look(witness, 2.1, owner=1)
    assert [line[:2] for line in observer.broken] == ["I4"]


def test_an_enable_of_another_than_the_owner_is_seen_and_a_takeover_is_none(observer: Observer) -> None:
    witness = StatusWitness(observer, lambda: inf)
    look(witness, 1.9, owner=1)
    witness.note_write(OTHER, write_one_pdu(0, 1), 1.95)
    look(witness, 2.0, owner=1)
    assert [line[:2] for line in observer.broken] == ["I4"]
    for control in (9, 0):
        witness.note_write(OTHER, write_one_pdu(0, control), 2.05)
    look(witness, 2.1, owner=1)
    assert len(observer.broken) == 1


def test_a_force_that_stands_while_the_output_or_the_cell_says_nothing_is_seen(observer: Observer) -> None:
    observer.voltage_v, observer.disabled_s, observer.write_s = 3.0, None, 2.0
    observer.cell_heard_s = 2.0
    observer.look(2.1)
    assert observer.broken == []
    observer.answers_lost_s = 1.5
    observer.look(2.1)
    observer.answers_lost_s, observer.cell_heard_s = None, 1.7
    observer.look(2.1)
    assert [line.partition(" at ")[0] for line in observer.broken] == ["I3 output", "I3 cell unheard"]


@pytest.mark.parametrize(("spoiled_s", "is_seen"), [(1.95, False), (1.7, True)])
def test_a_stop_may_wait_for_an_answer_that_is_lost_and_for_none_of_before(spoiled_s: float, is_seen: bool) -> None:
    """As long as any answer is waited for, whatever the loop's rate: on a fast one that is longer than its own times."""
    observer = Observer(replace(BOUNDS, period_s=0.01, reply_timeout_s=0.06))
    observer.voltage_v, observer.write_s, observer.cell_heard_s = 3.0, 2.0, 2.0
    observer.disabled_s, observer.answer_spoiled_s = 1.95, spoiled_s
    observer.look(2.03)
    assert bool(observer.broken) is is_seen
    observer.look(2.1)
    assert observer.broken


@pytest.mark.parametrize(
    ("pdu", "counts"),
    [
        (write_pdu(0, 1, 1200), 1200),
        (write_one_pdu(1, -300), -300),
        (floats_pdu(200, 1.0, 12.5, is_swapped=False), 1250),
        (floats_pdu(300, 1.0, 12.5, is_swapped=True), 1250),
    ],
)
def test_a_setpoint_is_read_from_every_spelling(pdu: bytes, counts: float) -> None:
    assert setpoints_of(pdu) == (counts,)


def test_what_writes_no_setpoint_has_none_and_a_mask_may_be_any() -> None:
    assert setpoints_of(write_one_pdu(0, 1)) == setpoints_of(floats_pdu(200, 1.0, is_swapped=False)) == ()
    (counts,) = setpoints_of(mask_pdu(1, 0, 5))
    assert counts != counts


@pytest.mark.parametrize(
    ("role", "address", "is_seen"), [("monitor", 0, True), ("setpoint", 1000, True), ("setpoint", 0, False)]
)
def test_a_write_beyond_a_certificates_role_is_seen(role: str, address: int, is_seen: bool) -> None:
    master = Master(OWNER, None, lambda: None, lambda *_: None)  # type: ignore[arg-type]
    master.badge = ("robot", role)
    master._judge_role(write_one_pdu(address, 0))
    assert bool(master.complaints) is is_seen


def test_of_two_uploads_at_a_time_either_may_be_in_use_and_of_one_alone_only_that_one() -> None:
    sets = Sets()
    sets.first, sets.allowed = b"old", {b"old"}
    sets.begin("one", b"first")
    sets.begin("other", b"second")
    sets.end("one", is_committed=True)
    assert sets.allowed == {b"first", b"second"}
    sets.end("other", is_committed=False)
    assert sets.allowed == {b"first", b"second"}
    sets.begin("one", b"third")
    sets.end("one", is_committed=True)
    assert sets.allowed == {b"third"}


def test_rare_events_come_in_their_order_and_each_is_whole_by_itself() -> None:
    drawn = [event for seed in range(200) for event in draw_rare_events(seed, 24.0)]
    for seed in range(200):
        times = [event.at_s for event in draw_rare_events(seed, 24.0)]
        assert times == sorted(times) and all(0.0 <= at_s < 24.0 for at_s in times)
    kinds = {(event.whom, event.what) for event in drawn}
    assert kinds >= {
        ("worker", "split"),
        ("worker", "burst"),
        ("designer", "upload"),
        ("world", "sim"),
        ("output", "power"),
    }
    assert kinds >= {("load_cell", "unit"), ("load_cell", "pace"), ("person", "say"), ("machine", "disk_broken")}
    assert all(replace(event) == event and isinstance(event, Event) for event in drawn)


def test_a_cause_that_is_named_by_what_a_client_has_chosen_is_seen() -> None:
    log = Log(VirtualClock())
    for cause in ("accepted 10.0.0.1", "noise serial:1", "refusal 10.0.0.2 out_of_range", "accepted 10.0.0.1"):
        log(cause, "")
    assert log.internal_errors == []
    log("accepted force_setpoint 12.5", "")
    assert log.internal_errors[0].startswith("I12")


def test_a_watchdog_that_has_forgotten_and_is_not_looked_at_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    events = [Event(3.0, "output", "power", (0.0827, 0.0)), Event(3.7, "rival", "hold", (14.49,))]
    assert not run_schedule(2076, events, 8.0).broken
    monkeypatch.setattr("gateway.service.running_rig.lines.device_checks._LOOK_PERIOD_S", 1e9)
    assert {line.partition(" at ")[0] for line in run_schedule(2076, events, 8.0).broken} == {"I6"}
