"""Where the receiver's decisions end: the shortest silence, stray bytes, frames across a silence, and what is forgotten."""

from itertools import pairwise
from random import Random

import pytest

from gateway.modbus import pdu as P  # noqa: N812
from gateway.modbus import rtu_receiver
from gateway.modbus.rtu import encode_adu, is_whole
from gateway.modbus.rtu_receiver import MOST_BYTES, SPLIT_S, RtuReceiver, RtuRequest
from tests.modbus.host_answers import loopback_request, report_request, write_coil_request
from tests.modbus.rtu_bus import BAUD, CHARACTER_S, SILENCE_S, Bus
from tests.modbus.test_rtu_receiver import COMMAND, INSIDE, OURS, READ, WRITE, answered


def test_a_silence_is_one_from_its_first_moment() -> None:
    """What begins behind it counts, also where the line is known for the unit whose frame was cut off before."""
    begun = encode_adu(2, P.write_registers_request(0, bytes(40)))[:7]
    for silences, heard in ((0.5, []), (1.05, answered())):
        bus = Bus()
        assert bus.send(encode_adu(2, READ)).requests() == []
        assert bus.send(begun, OURS, pause_s=silences * SILENCE_S).requests() == heard, silences
    receiver = RtuReceiver(1, BAUD, CHARACTER_S, may_echo=True)
    receiver.receive(encode_adu(2, READ), 0.0)
    receiver.take(1.0)
    receiver.receive(begun, 0.0)
    silent_s = receiver.deadline_s or 0.0
    receiver.receive(OURS, silent_s)
    assert receiver.take(silent_s + SILENCE_S) == [], "it could be a part of what was begun, until that is over"
    assert receiver.take(receiver.deadline_s or 0.0) == answered(), "from the moment on at which it would be taken"


def test_stray_bytes_behind_a_request_do_not_delay_its_answer() -> None:
    for stray in (b"", b"\x00", b"\x01", b"\x07\x03"):
        bus = Bus()
        begin_s = bus.now_s
        assert bus.send(OURS + stray).pause(1.0).heard == [(begin_s + SILENCE_S, RtuRequest(1, READ, True))], (
            stray.hex()
        )


def test_one_or_two_bytes_begin_no_frame_of_another_unit_and_three_may() -> None:
    for begun, heard in ((b"\x07", answered(WRITE)), (b"\x07\x10", answered(WRITE)), (b"\x07\x03\xf0", [])):
        bus = Bus()
        bus.send(encode_adu(7, READ)).requests()
        assert bus.send(begun + COMMAND).requests() == heard, begun.hex()


def test_half_a_request_of_our_own_hides_nothing_however_often_we_were_asked() -> None:
    long = encode_adu(1, P.write_registers_request(0, bytes(100)))
    bus = Bus()
    assert bus.send(OURS).requests() == answered()
    assert bus.send(long[:40] + OURS).requests() == answered()


def test_a_frame_across_a_silence_does_not_hide_the_request_behind_it() -> None:
    """Noise and the first byte of our request are a refusal of another unit, with its checksum."""
    refusals = (encode_adu(unit, bytes((0x83, code))) for unit in range(2, 248) for code in range(1, 12))
    made = next(frame for frame in refusals if frame[-1] == OURS[0])[:-1]
    bus = Bus().send(made, OURS, pause_s=0.006)
    assert bus.requests() == answered() and (bus.receiver.frames, bus.receiver.noise_bytes) == (1, len(made))


def test_a_request_inside_of_another_s_frame_behind_noise_is_none() -> None:
    around = b"\x55\x66\x77\x88"
    behind = INSIDE.index(COMMAND) + len(COMMAND)
    bus = Bus()
    bus.send(encode_adu(7, READ)).requests()
    assert bus.send(around + INSIDE[:behind], INSIDE[behind:] + around, pause_s=0.016).requests() == []


def test_what_was_dropped_without_a_silence_has_told_its_unit() -> None:
    bus = Bus()
    bus.send(encode_adu(7, READ) * (MOST_BYTES // len(OURS) + 1))
    assert bus.send(INSIDE[:7] + OURS).requests() == []


def test_of_a_flood_no_more_is_dropped_than_there_is_no_room_for() -> None:
    """Frames that are made out make room: what is behind them stays, though it is longer than the longest frame."""
    long = encode_adu(7, P.write_registers_request(0, bytes(242)))
    flood = encode_adu(7, READ) * (MOST_BYTES // len(OURS) - len(long) // len(OURS))
    assert len(flood + COMMAND + long) > MOST_BYTES
    assert Bus().send(flood + b"\x55" + COMMAND + long).requests() == [RtuRequest(1, WRITE, False)]


def test_where_silences_were_is_forgotten_with_the_port() -> None:
    at = INSIDE.index(COMMAND)
    bus = Bus().send(b"\x07" * at, b"\x07", pause_s=0.006)
    bus.receiver.forget()
    assert bus.send(INSIDE[:-1] + b"\x55").requests() == []


def test_a_request_with_more_bytes_than_it_says_is_none() -> None:
    for pdu in (WRITE, READ, P.write_registers_request(0, bytes(4))):
        assert Bus().send(encode_adu(1, pdu + bytes(2))).requests() == []


MANY = P.write_registers_request(0, bytes(8))
LONG_ECHO = loopback_request(bytes(8))  # of a length that only its checksum tells


def known(*heard_before: int) -> Bus:
    """A line on which these other units were heard."""
    bus = Bus()
    for unit in heard_before:
        assert bus.send(encode_adu(unit, READ)).requests() == []
    return bus


def test_a_broadcast_in_two_reads_is_one_frame() -> None:
    for pdu in (WRITE, MANY, write_coil_request(0, True), P.mask_write_request(0, 1, 2)):
        frame = encode_adu(0, pdu)
        for cut in range(1, len(frame)):
            assert Bus().send(frame[:cut], frame[cut:], pause_s=0.016).requests() == [RtuRequest(0, pdu, False)], cut


def test_an_answer_waits_for_the_silence_and_only_where_more_may_come_for_the_longest_pause() -> None:
    """From the last byte on: what has come late before makes the next wait no longer."""
    late, stray = (OURS[:5], OURS[5:]), (b"\x00", b"\xff", b"\x01")
    for chunks in (late, *((each + OURS,) for each in stray), (OURS + b"\xff\xff\xff",), (INSIDE[:6], OURS)):
        bus = Bus()
        assert bus.send(*chunks[:-1], pause_s=0.01).heard == []
        begin_s = bus.now_s
        assert bus.send(chunks[-1]).pause(1.0).heard == [(begin_s + SILENCE_S, RtuRequest(1, READ, True))], chunks
    for stray, pdu in (
        (b"\x00", report_request()),  # its first bytes could claim more than there is
        (b"\x01", WRITE),
        (b"\x09", P.read_request(4, 100, 12)),  # or just as much: an answer of 9 to FC01
    ):
        bus = Bus()
        begin_s = bus.now_s
        heard = [(begin_s + SILENCE_S, RtuRequest(1, pdu, True))]
        assert bus.send(stray + encode_adu(1, pdu)).pause(1.0).heard == heard
    bus = Bus()
    begin_s = bus.now_s
    assert bus.send(COMMAND + OURS[:3]).pause(1.0).heard == [(begin_s + SPLIT_S, RtuRequest(1, WRITE, True))]


def test_a_frame_without_a_length_is_heard_behind_another_and_behind_a_silence() -> None:
    frame = encode_adu(1, LONG_ECHO)
    assert Bus().send(COMMAND + frame).requests() == [RtuRequest(1, WRITE, False), RtuRequest(1, LONG_ECHO, True)]
    assert Bus().send(b"\x00", frame, pause_s=0.016).requests() == answered(LONG_ECHO)
    assert Bus().send(b"\x00" + frame).requests() == [], "in noise a checksum alone is too little"


def test_each_byte_that_is_no_part_of_a_frame_is_counted_once() -> None:
    bus = Bus().send(b"\x07", COMMAND + b"\x07\x03\xf0", OURS + b"\xff", pause_s=0.016)
    assert bus.requests() == [RtuRequest(1, WRITE, False), *answered()]
    assert (bus.receiver.frames, bus.receiver.noise_bytes) == (2, 5)


def test_a_silence_is_kept_when_a_flood_before_it_is_dropped() -> None:
    bus = Bus().send(b"\x55" * 300 + b"\x07", pause_s=0.005)
    assert bus.send(OURS + b"\x55" * (MOST_BYTES - 290)).requests() == answered()


def test_what_goes_beyond_a_begun_frame_is_no_part_of_it_and_what_ends_with_it_may_be() -> None:
    for begun, heard in ((b"\x07\x03\x00", answered()), (b"\x07\x03\x06", []), (b"\x07\x03\x07", [])):
        assert known(7).send(begun + OURS).requests() == heard, begun.hex()


def test_a_stray_byte_behind_a_silence_costs_nothing_whatever_unit_it_looks_like() -> None:
    """Also where a frame of that unit was cut off before the silence."""
    assert known(7).send(b"\x00\x00", b"\x07" + encode_adu(1, MANY), pause_s=0.0021).requests() == answered(MANY)
    assert known(7).send(b"\x07\x03\xf0", b"\x2d" + COMMAND, pause_s=0.01).requests() == answered(WRITE)


def test_a_begun_frame_hides_what_follows_only_where_a_frame_may_begin_and_its_unit_is_known() -> None:
    assert known(7).send(b"\x00\x00\x00\x07\x03\xf0" + COMMAND).requests() == answered(WRITE)
    for before in (b"", b"\x55"):  # behind a silence, and with a stray byte there
        assert known(7).send(b"\x55\x66\x77\x01", before + b"\x07\x03\xf0" + OURS, pause_s=0.01).requests() == []
        assert Bus().send(b"\x55\x66\x77\x01", before + b"\x07\x03\xf0" + OURS, pause_s=0.01).requests() == answered()


def test_behind_another_s_frame_in_noise_a_silence_still_begins_the_next() -> None:
    assert known(7).send(b"\x07\x03\xf0" + encode_adu(7, READ), OURS, pause_s=0.01).requests() == answered()


def test_what_begins_behind_a_silence_inside_of_another_s_frame_in_noise_is_heard_unless_that_one_is_known() -> None:
    """Noise makes frames of units that are not there, checksum and all; a silence is not made so easily."""
    around = encode_adu(9, bytes((3, 2 + len(COMMAND))) + b"\x55" + COMMAND + b"\x55")
    at = around.index(COMMAND)
    for heard_before, heard in (((7,), answered(WRITE)), ((7, 9), [])):
        bus = known(*heard_before).send(b"\x07\x03\xf0" + around[:at], around[at:], pause_s=0.01)
        assert bus.requests() == heard, heard_before


def test_behind_a_stray_byte_a_frame_counts_where_frames_reach_to_the_next_silence() -> None:
    both = [RtuRequest(1, WRITE, False), *answered()]
    assert Bus().send(b"\x0a" + COMMAND, OURS + b"\x00", pause_s=0.0021).requests() == both
    assert Bus().send(b"\x77" + encode_adu(0, WRITE) + b"\x03", b"\xf0", pause_s=0.016).requests() == []


def test_a_broadcast_is_obeyed_on_a_busy_bus_that_comes_in_pieces_without_a_silence() -> None:
    """An adapter that hands over every 16 ms, each time in the middle of another unit's answer: a stop to everybody made room
    for what came behind it, and nobody says a broadcast again."""
    stop = P.write_register_request(0, 0)
    polls = (encode_adu(7, READ) + encode_adu(7, bytes((3, 240)) + bytes(240))) * 8
    line = encode_adu(0, stop) + polls
    bus = Bus(baud=115200)
    bus.send(*(line[at : at + 156] for at in range(0, len(line), 156)), pause_s=0.016)
    assert bus.requests() == [RtuRequest(0, stop, False)]
    assert bus.receiver.noise_bytes == 0


def test_of_a_flood_of_broadcasts_the_latest_are_obeyed_in_their_order_and_none_behind_a_plug() -> None:
    writes = [P.write_register_request(1, count) for count in range(200)]
    flood = b"".join(encode_adu(0, write) for write in writes)
    bus = Bus().send(*(flood[at : at + 100] for at in range(0, len(flood), 100)))
    taken = [request.pdu for request in bus.requests()]
    assert taken == writes[-len(taken) :] and len(taken) > 8
    bus.send(flood).receiver.forget()
    assert bus.requests() == []


def test_frames_inside_of_frames_take_no_time_that_doubles_with_each(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each behind a silence of its own: 22 of them in 188 bytes held up control for 13 s."""
    levels, frame, places = 16, encode_adu(9, READ), [0]
    for _ in range(levels):
        frame = encode_adu(9, bytes((16, 0, 0, 0, len(frame) // 2, len(frame))) + frame)
        places = [0, *(place + 7 for place in places)]
    looked = list[int]()

    def note_and_judge(data: bytes, size: int) -> bool:
        looked.append(size)
        return is_whole(data, size)

    monkeypatch.setattr(rtu_receiver, "is_whole", note_and_judge)
    bus = Bus()
    bus.send(*(frame[at:end] for at, end in pairwise([*places, len(frame)])), pause_s=1.5 * SILENCE_S)
    assert bus.send(OURS).requests() == answered()
    assert len(looked) < 40 * levels


def test_slow_noise_is_looked_through_as_it_comes_and_not_all_of_it_with_each_byte(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A byte in 2 ms, each behind a silence, took a whole core, and control and its loop with it."""
    measured: list[int] = []
    ends = RtuReceiver._claimed_end
    monkeypatch.setattr(RtuReceiver, "_claimed_end", lambda heard, at: measured.append(at) or ends(heard, at))
    noise = bytes(Random(7).choices(b"\x00\x01\x03\x10", k=500))
    bus = Bus(baud=115200)
    bus.send(*(bytes((byte,)) for byte in noise), pause_s=0.002)
    assert len(measured) < 15 * len(noise)
    assert bus.send(OURS).requests() == answered()
    assert bus.receiver.noise_bytes == len(noise) and bus.receiver.frames == 1


def test_a_frame_in_as_many_pieces_as_an_adapter_makes_is_one() -> None:
    """Each 16 ms hand-over has what the line has brought since; a machine that is late hands over more, later."""
    long = encode_adu(1, P.write_registers_request(0, bytes(242)))
    for baud in (2400, 9600, 19200, 115200):
        size = max(1, int(0.016 * baud / 11))
        pieces = [long[at : at + size] for at in range(0, len(long), size)]
        bus = Bus(baud=baud)
        bus.send(*pieces[:-2], pause_s=0.016).send(pieces[-2], pause_s=0.0195)
        assert bus.send(pieces[-1]).requests() == [RtuRequest(1, long[1:-2], True)], baud


def test_a_request_that_slow_noise_follows_is_executed_and_not_answered() -> None:
    bus = Bus()
    bus.send(COMMAND + b"\x07\x03\xf0", *(b"\x07",) * 12, pause_s=0.004)
    assert [request for _, request in bus.heard] == [RtuRequest(1, WRITE, False)]
    assert bus.heard[0][0] < 100.05
    bus.pause(1.0)
    assert (bus.receiver.frames, bus.receiver.noise_bytes) == (1, 3 + 12)


def test_a_frame_of_others_is_not_cut_where_its_first_piece_is_given_up() -> None:
    begun = INSIDE.index(COMMAND)
    bus = Bus(baud=115200)
    bus.send(encode_adu(7, READ)).requests()
    bus.send(*(b"\x07",) * 9, pause_s=0.004).send(INSIDE[:begun], pause_s=0.0195)
    assert bus.send(INSIDE[begun:] + b"\x07\x03\xf0", *(b"\x07",) * 12, pause_s=0.004).requests() == []


def test_a_request_behind_a_moment_of_noise_is_answered_at_once() -> None:
    bus = Bus(baud=115200)
    bus.send(bytes(Random(5).choices(b"\x00\x01\x03\x10", k=MOST_BYTES)), pause_s=0.003)
    begin_s = bus.now_s
    assert bus.send(OURS).pause(1.0).heard == [(begin_s + 1.75e-3, RtuRequest(1, READ, True))]


@pytest.mark.parametrize("pool", [bytes(range(256)), b"\x00\x01\x03\x10"])
def test_noise_that_never_ends_is_looked_at_for_an_eighth_of_a_core_and_no_request_behind_it_waits(pool: bytes) -> None:
    """16 bytes in 1.8 ms of 115200 baud are silent for a moment each time, and half a kilobyte was looked through in it."""
    chance, looked_at, now_s = Random(3), 0, 0.0
    receiver = RtuReceiver(1, 115200, 11 / 115200, may_echo=True)
    for _ in range(1500):
        receiver.receive(bytes(chance.choices(pool, k=16)), now_s)
        while (deadline_s := receiver.deadline_s) is not None and deadline_s < now_s + 0.0018:
            looked_at += len(receiver._burst)
            assert receiver.take(deadline_s) == []
        now_s += 0.0018
    assert 0.5 * now_s / 40e-6 < looked_at < now_s / 40e-6 + 6 * MOST_BYTES  # of which five may be looked at ahead
    receiver.receive(OURS, now_s + 0.02)
    silent_s = receiver.deadline_s or 0.0
    assert silent_s < now_s + 0.05 and receiver.take(silent_s) == answered()
