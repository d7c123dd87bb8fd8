"""Answers that come back from an adapter that hears itself: nothing is executed twice, and no master's write is lost."""

import pytest

from gateway.modbus import pdu as P  # noqa: N812
from gateway.modbus.rtu import encode_adu, silence_s
from gateway.modbus.rtu_receiver import RtuRequest
from tests.modbus.rtu_bus import CHARACTER_S, SILENCE_S, Bus

READ, READ_ANSWER = P.read_request(3, 100, 12), b"\x03\x18" + bytes(24)
WRITE = P.write_register_request(1, 1200)
ANSWERS = {READ: READ_ANSWER, WRITE: WRITE}
ANSWER_S = 8 * CHARACTER_S
AT_ONCE = 2 * ANSWER_S + 1.1 * SILENCE_S  # from our answer to the end of the next request of one that does not wait


def exchange(bus: Bus, pdu: bytes, *, echo_s: float | None = None) -> int:
    """How often a request is executed that a master sends once; its answer comes back after echo_s, and so on."""
    ended_s = silence_s(bus.baud, 11 / bus.baud)
    bus.send(encode_adu(1, pdu)).pause(1.05 * ended_s)
    executed = 0
    while bus.heard and executed < 50:
        ((_, heard),) = bus.heard
        bus.heard.clear()
        executed += not heard.is_in_doubt
        answer = encode_adu(1, P.exception_pdu(pdu[0], 6) if heard.is_in_doubt else ANSWERS.get(pdu, pdu))
        bus.receiver.note_sent(heard, answer, bus.now_s)
        if echo_s is not None:
            bus.pause(echo_s).send(answer).pause(1.05 * ended_s)
    return executed


def test_an_echo_executes_nothing() -> None:
    for first in (WRITE, READ):
        bus = Bus()
        for pdu in (first, WRITE, WRITE, READ, WRITE):
            assert exchange(bus, pdu, echo_s=ANSWER_S + 1e-3) == 1
            bus.pause(0.1)


def test_a_late_echo_ends_by_itself_and_is_known_after_the_first_read() -> None:
    bus = Bus(baud=115200)
    late_s = 8 * 11 / 115200 + 0.016
    assert 1 < exchange(bus, WRITE, echo_s=late_s) < 6
    assert exchange(bus.pause(0.1), READ, echo_s=late_s) == 1
    assert [exchange(bus.pause(0.1), WRITE, echo_s=late_s) for _ in range(5)] == [1] * 5


def test_equal_writes_of_a_master_are_all_executed() -> None:
    """As fast as the wire allows, once a read has shown that there is no echo; and slowly always."""
    bus = Bus()
    exchange(bus, READ)
    bus.pause((len(READ_ANSWER) - len(WRITE)) * CHARACTER_S)  # its answer takes so much longer
    assert [exchange(bus.pause(AT_ONCE), WRITE) for _ in range(500)] == [1] * 500
    bus = Bus()
    assert [exchange(bus.pause(0.12), WRITE) for _ in range(100)] == [1] * 100


@pytest.mark.parametrize(("row", "refused"), [(2, 0), (3, 0), (4, 0), (5, 3), (8, 3), (1000, 3)])
def test_of_all_rows_of_quick_equal_writes_a_few_are_refused_and_the_line_is_known(row: int, refused: int) -> None:
    """A master that never reads lost one of each row of two, its answer waited for until it gave up."""
    bus, executed = Bus(), 0
    for value in range(1000 // row):
        executed += sum(exchange(bus.pause(AT_ONCE), P.write_register_request(1, value)) for _ in range(row))
    assert executed == 1000 // row * row - refused


def test_a_late_echo_ends_on_a_slow_line_too() -> None:
    """What an adapter holds it up comes on top of the time that it takes on the wire."""
    assert 1 < exchange(Bus(baud=9600), WRITE, echo_s=8 * 11 / 9600 + 0.016) < 6


@pytest.mark.parametrize("late_s", [0.016, 0.03, 0.09])
def test_a_master_that_only_writes_is_heard_once_behind_a_late_echo(late_s: float) -> None:
    """No read shows the echo: each write was answered up to 3, then 30, then 300 times, into what the master asked next."""
    bus = Bus()
    beats = [P.write_register_request(4, beat) for beat in range(300)]
    executed = [exchange(bus, beat, echo_s=ANSWER_S + late_s) for beat in beats]
    assert 1 < executed[0] < 6 and executed[1:] == [1] * 299


def test_a_write_that_may_be_an_echo_behind_another_s_request_is_executed_and_tells_nothing() -> None:
    """It is not answered, so that nothing can come back."""
    bus = Bus()
    assert [exchange(bus.pause(AT_ONCE), WRITE) for _ in range(4)] == [1, 1, 1, 1]
    bus.pause(AT_ONCE).send(encode_adu(1, WRITE) + encode_adu(7, READ))
    assert bus.requests() == [RtuRequest(1, WRITE, False)]


def test_a_stop_right_behind_an_enable_is_executed_whatever_was_written_before() -> None:
    """It equals an answer before the last, as an echo on its second round does."""
    enable, stop = P.write_register_request(0, 1), P.write_register_request(0, 0)
    bus = Bus(baud=115200)
    row = (stop, enable, enable, enable, enable, stop, P.write_register_request(1, 500), stop)
    assert [exchange(bus.pause(0.004), pdu) for pdu in row] == [1] * len(row)


def executed_on_an_echoing_line(latency_s: float, writes: list[tuple[float, bytes]]) -> list[bytes]:
    """What is executed within two seconds, of writes at their times: all that is on the wire comes late, in its order."""
    bus, executed = Bus(), list[bytes]()
    begin_s = bus.now_s
    coming = [(at_s + ANSWER_S, encode_adu(1, pdu)) for at_s, pdu in writes]
    while coming and coming[0][0] < 2.0:
        coming.sort(key=lambda one: one[0])
        at_s, frame = coming.pop(0)
        bus.pause(max(0.0, begin_s + at_s + latency_s - bus.now_s)).send(frame)
        bus.pause(1.05 * SILENCE_S)
        for _, heard in bus.heard:
            is_refused = heard.is_in_doubt or heard.pdu[0] > 127  # a refusal of ours that another answer has followed
            executed += [heard.pdu] * (not is_refused)
            answer = P.exception_pdu(heard.pdu[0], 6 if heard.is_in_doubt else 1) if is_refused else heard.pdu
            if heard.is_answered:
                bus.receiver.note_sent(heard, encode_adu(1, answer), bus.now_s)
                coming.append((bus.now_s - begin_s + len(answer) * CHARACTER_S, encode_adu(1, answer)))
        bus.heard.clear()
    return executed


@pytest.mark.parametrize("latency_s", [0.004, 0.01, 0.016, 0.03])
@pytest.mark.parametrize("apart_s", [0.02, 0.033, 0.05, 0.09, 0.15])
def test_no_enable_comes_back_behind_the_stop_that_a_master_has_written(latency_s: float, apart_s: float) -> None:
    """Their echoes followed each other round and round, and the force went on and off."""
    enable, stop = P.write_register_request(0, 1), P.write_register_request(0, 0)
    executed = executed_on_an_echoing_line(latency_s, [(0.0, enable), (apart_s, stop)])
    first = executed.index(stop)
    assert set(executed[first:]) == {stop} and len(executed) < 10


def test_a_refusal_whose_echo_may_still_come_tells_nothing_of_the_line() -> None:
    """Its adapter and this machine are slow: the line was taken for one without an echo, and what came back was answered, heard
    and answered again without an end."""
    enable, stop = P.write_register_request(0, 1), P.write_register_request(0, 0)
    writes = [(0.05, enable), (0.14, enable), (0.19, stop), (0.28, stop)]
    assert len(executed_on_an_echoing_line(0.06, writes)) < 10


@pytest.mark.parametrize(
    ("latency_s", "writes"),
    [
        (0.016, [(35, 0), (55, 1), (75, 0), (185, 0)]),  # its own stop was taken for the echo of the one before
        (
            0.06,
            [(150, 1), (170, 1), (260, 1), (310, 1), (360, 1), (460, 0)],
        ),  # two answers on their way, on a known line
        (0.03, [(50, 0), (160, 1), (210, 0), (240, 0), (270, 1), (360, 1), (380, 1), (420, 0)]),  # one late, once
    ],
)
def test_echoes_of_a_master_that_waits_for_no_answer_end(latency_s: float, writes: list[tuple[int, int]]) -> None:
    """Enables came back behind its last stop, without an end."""
    given = [(at_ms / 1e3, P.write_register_request(0, word)) for at_ms, word in writes]
    executed = executed_on_an_echoing_line(latency_s, given)
    assert len(executed) < 3 * len(writes)
    assert not executed[-1].endswith(b"\x01")


def test_an_echo_in_two_pieces_is_one() -> None:
    ones = b"\x03\x18" + 24 * b"\xff"  # none of which begins a frame by itself
    bus, answer = Bus(), encode_adu(1, ones)
    for cut in range(2, len(answer)):
        ((_, heard),) = bus.send(encode_adu(1, READ)).pause(1.05 * SILENCE_S).heard
        bus.heard.clear()
        bus.receiver.note_sent(heard, answer, bus.now_s)
        bus.pause(0.01).send(answer[:cut], answer[cut:], pause_s=0.01)
        assert bus.requests() == [] and bus.receiver.noise_bytes == 0, cut


def test_a_terminal_has_no_echo_also_when_it_was_opened_again() -> None:
    bus = Bus(may_echo=False)
    assert [exchange(bus, WRITE) for _ in range(100)] == [1] * 100
    bus.receiver.forget()
    assert [exchange(bus.pause(AT_ONCE), WRITE) for _ in range(100)] == [1] * 100


def test_another_adapter_may_be_otherwise() -> None:
    bus = Bus()
    for _ in range(2):  # the second request shows that the first one's answer has not come back
        exchange(bus.pause(0.1), READ)
    bus.receiver.forget()
    assert exchange(bus, WRITE, echo_s=ANSWER_S + 1e-3) == 1


def test_an_echo_is_known_as_long_as_no_master_can_have_been_as_fast() -> None:
    for echo_s in (ANSWER_S + 1.5 * SILENCE_S, 2.0 * ANSWER_S + 0.9 * SILENCE_S):
        assert exchange(Bus(), WRITE, echo_s=echo_s) == 1


def test_an_echo_that_got_lost_is_known_again_when_the_next_comes() -> None:
    bus, back_s = Bus(), ANSWER_S + 1e-3
    for echo_s in (back_s, None, None, back_s):
        assert exchange(bus.pause(0.1), READ, echo_s=echo_s) == 1
    late_s = ANSWER_S + 0.016
    assert [exchange(bus.pause(0.1), WRITE, echo_s=late_s) for _ in range(5)] == [1] * 5


def test_a_pause_ends_a_row_of_equal_writes() -> None:
    """Three at once are a master's however often it sends them."""
    bus = Bus()
    for _ in range(20):
        assert [exchange(bus.pause(pause_s), WRITE) for pause_s in (0.12, AT_ONCE, AT_ONCE, AT_ONCE)] == [1] * 4


@pytest.mark.parametrize("parted", [False, True])
@pytest.mark.parametrize("last", [P.write_register_request(0, 0), READ])
def test_an_echo_that_comes_behind_the_next_request_is_one_all_the_same(last: bytes, parted: bool) -> None:
    """A master that gave up early asks again while our answer waits to be sent: what it writes then, a stop, was undone by
    the echo of the write before it. It does not listen, so that it is not answered: its answer would come back as well."""
    bus = Bus()
    exchange(bus, READ, echo_s=ANSWER_S + 1e-3)
    ((_, heard),) = bus.pause(0.1).send(encode_adu(1, WRITE)).pause(1.05 * SILENCE_S).heard
    bus.heard.clear()
    bus.receiver.note_sent(heard, encode_adu(1, WRITE), bus.now_s)
    pieces = (encode_adu(1, last), encode_adu(1, WRITE))
    bus.send(*(pieces if parted else [b"".join(pieces)]), pause_s=0.01)
    assert bus.requests() == [RtuRequest(1, last, False)]
    assert exchange(bus, WRITE, echo_s=ANSWER_S + 1e-3) == 1
    assert exchange(bus.pause(0.1), READ, echo_s=ANSWER_S + 0.016) == 1


def test_an_echo_that_is_awaited_no_more_leaves_no_request_without_an_answer() -> None:
    bus = Bus()
    exchange(bus, READ, echo_s=ANSWER_S + 1e-3)
    exchange(bus.pause(0.1), READ)
    assert bus.pause(0.1).send(encode_adu(1, READ)).requests() == [RtuRequest(1, READ, True)]


@pytest.mark.parametrize("handed_over_s", [0.0, 0.016])
def test_a_master_that_speaks_before_the_first_answer_has_come_tells_nothing_of_its_echo(handed_over_s: float) -> None:
    """The line was taken for one without an echo: each write was then answered, heard again and answered without an end."""
    bus, late_s = Bus(baud=115200), 8 * 11 / 115200 + 0.016
    ((_, heard),) = bus.send(encode_adu(1, READ)).pause(0.002).heard
    bus.heard.clear()
    bus.receiver.note_sent(heard, encode_adu(1, READ_ANSWER), bus.now_s)
    bus.pause(handed_over_s).send(encode_adu(1, WRITE) + encode_adu(1, READ_ANSWER))
    assert bus.requests() == [RtuRequest(1, WRITE, False)]
    assert [exchange(bus.pause(0.1), WRITE, echo_s=late_s) for _ in range(5)] == [1] * 5


def test_a_master_that_leaves_no_silence_is_answered_each_time() -> None:
    """Whatever it writes, and whether or not a read has shown yet that there is no echo."""
    for first in ((), (READ,)):
        bus = Bus()
        for pdu in (*first, *(P.write_register_request(4, beat) for beat in range(100))):
            ((_, heard),) = bus.send(encode_adu(1, pdu)).pause(1.05 * SILENCE_S).heard
            bus.heard.clear()
            assert heard == RtuRequest(1, pdu, True)
            answer = encode_adu(1, ANSWERS.get(pdu, pdu))
            bus.receiver.note_sent(heard, answer, bus.now_s)
            bus.pause((len(answer) + 8) * CHARACTER_S)
