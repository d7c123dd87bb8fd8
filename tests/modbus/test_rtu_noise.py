"""Which frames count in noise and behind a silence, and what may hide one: claims of units, known or not, and their ends."""

from itertools import pairwise, product

import pytest

from gateway.modbus import pdu as P  # noqa: N812
from gateway.modbus.crc import crc16
from gateway.modbus.identification import MEI_TYPE
from gateway.modbus.rtu import encode_adu
from gateway.modbus.rtu_receiver import MOST_BYTES, SPLIT_S, RtuReceiver, RtuRequest
from tests.modbus.host_answers import loopback_request
from tests.modbus.rtu_bus import BAUD, CHARACTER_S, SILENCE_S, Bus
from tests.modbus.test_rtu_receiver import COMMAND, INSIDE, OURS, READ, WRITE, answered, registers_answer
from tests.modbus.test_rtu_receiver_limits import MANY, known

ODD = b"\x41\x01\x02"  # of a function that nobody knows: its checksum alone tells its end


def test_a_unit_that_is_not_here_takes_no_claim_away() -> None:
    """Another's answer of 21 bytes is begun and cut off; its second byte may begin a longer frame of unit 3."""
    command = encode_adu(1, P.write_register_request(1, 0x2000))
    assert known(7).send(b"\x07\x03\x10" + command).requests() == []
    assert Bus().send(b"\x07\x03\x10" + command).requests() == answered(command[1:-2])


def test_of_two_claims_with_one_end_the_first_keeps_its_stray_bytes() -> None:
    pdu = P.write_registers_request(0, bytes(2))
    assert known(7, 18).send(b"\x07\x03\x12" + encode_adu(1, pdu)).requests() == []


@pytest.mark.parametrize(("stray", "heard"), [(b"\x55\x66", []), (b"\x55\x66\x55", answered())])
def test_a_claim_may_stand_behind_two_stray_bytes(stray: bytes, heard: list[object]) -> None:
    assert known(7).send(stray + b"\x07\x03\xf0" + OURS).requests() == heard


def test_noise_that_could_have_been_just_as_long_is_not_waited_for() -> None:
    """A read of unit 9 with a wrong checksum: its last byte is there, so nothing more can come of it."""
    bus = Bus()
    begin_s = bus.now_s
    bus.send(COMMAND + bytes.fromhex("09 04 0001 0002 ff ff")).pause(1.0)
    assert [(heard_s, request.pdu) for heard_s, request in bus.heard] == [(begin_s + SILENCE_S, WRITE)]


def test_the_last_byte_of_noise_may_begin_a_request() -> None:
    assert Bus().send(b"\xfe\xff" + OURS[:1], OURS[1:], pause_s=0.01).requests() == answered()


@pytest.mark.parametrize("size", range(1, 8))
def test_a_loopback_in_two_pieces_is_one_whatever_stands_at_the_end_of_the_first(size: int) -> None:
    """A byte above 247 begins nothing, so that only the function tells that more is to come."""
    request = encode_adu(1, loopback_request(b"\xff\xff"))
    assert Bus().send(request[:size], request[size:], pause_s=0.016).requests() == answered(request[1:-2])


@pytest.mark.parametrize("stray", [b"\x55\x66\x55", b"\x07\x03\xf0", b"\x05\x10\x00\x00\x00\x7b\xf6"])
def test_a_read_of_the_identification_is_heard_behind_noise_as_soon_as_any_read(stray: bytes) -> None:
    """Its length is known, unlike that of another use of its function: no silence behind it is waited for."""
    heard_s = []
    for pdu in (READ, bytes((P.ENCAPSULATED, MEI_TYPE, 1, 0))):
        bus = Bus()
        begin_s = bus.now_s
        bus.send(stray, encode_adu(1, pdu), pause_s=0.01).pause(1.0)
        ((at_s, request),) = bus.heard
        assert request.pdu == pdu
        heard_s.append(at_s - begin_s)
    assert heard_s[1] == pytest.approx(heard_s[0], abs=1e-9)


def test_an_answer_under_our_own_number_is_no_request() -> None:
    """Whoever sends it, another device that was given our number or an echo."""
    assert Bus().send(registers_answer(1, bytes(4))).requests() == []
    assert Bus().send(registers_answer(1, bytes(24)) + OURS).requests()[-1:] == answered()


def test_a_frame_whose_end_only_its_checksum_tells_does_not_reach_across_a_silence() -> None:
    around = encode_adu(7, b"\x41\x55" + COMMAND + b"\x55")
    at = around.index(COMMAND)
    assert Bus().send(around[:at], around[at:], pause_s=0.01).requests() == answered(WRITE)
    assert Bus().send(around).requests() == []


@pytest.mark.parametrize("pdu", [WRITE, ODD])
def test_a_request_behind_a_silence_is_one_though_noise_before_it_makes_a_frame_with_the_same_end(pdu: bytes) -> None:
    """An answer of unit 9, checksum and all: the checksum of what noise has made so far is what one begins with."""
    request = encode_adu(1, pdu)
    begun = (bytes((9, 3, 1 + len(request), *two, 0)) for two in product(range(256), repeat=2))
    made = next(each for each in begun if crc16(each) == 0xFFFF)
    assert len(made + request) == 3 + made[2] + 2 and crc16(made + request) == 0
    assert Bus().send(made, request, pause_s=0.01).requests() == answered(pdu)


def test_our_own_refusal_of_a_function_that_nobody_knows_is_heard_as_an_echo_in_noise() -> None:
    bus = Bus().send(encode_adu(1, ODD))
    (request,) = bus.requests()
    refusal = encode_adu(1, b"\xc1\x01")
    bus.receiver.note_sent(request, refusal, bus.now_s)
    assert bus.send(b"\x55\x66\x55\x66" + refusal).requests() == []
    assert (bus.receiver.frames, bus.receiver.noise_bytes) == (2, 4)
    assert bus.send(encode_adu(1, READ)).requests() == answered()


@pytest.mark.parametrize("before", [b"\xff", b"\xff\xff\xff", b"\x05\x10\x00\x00\x00\x7b\xf6"])
def test_a_row_of_frames_between_two_bits_of_noise_is_walked_once(
    before: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From each frame of the row to its end, which is noise: half a kilobyte was 33 ms of the control loop."""
    looks = 0
    look = RtuReceiver._frame_size

    def counted(self: RtuReceiver, at: int, *, is_start: bool) -> int:
        nonlocal looks
        looks += 1
        return look(self, at, is_start=is_start)

    monkeypatch.setattr(RtuReceiver, "_frame_size", counted)
    burst = before + 120 * encode_adu(3, b"\x11") + b"\xff"
    bus = known(2)
    looks = 0
    assert bus.send(burst).requests() == []
    assert looks < 3 * len(burst)


def test_a_request_that_had_to_make_room_for_another_s_frame_is_executed_and_not_answered() -> None:
    """Its master went on without a silence: an answer would go into what another one is saying."""
    bus = known(7)
    begun = encode_adu(7, P.write_registers_request(0, bytes(40)))[:20]
    flood = encode_adu(7, READ) * (MOST_BYTES // len(OURS) - 1)
    assert len(flood + OURS + begun) > MOST_BYTES
    assert bus.send(flood + OURS + begun).requests() == [RtuRequest(1, READ, False)]


def test_a_frame_that_has_to_make_room_is_measured_anew_and_not_as_long_as_one_that_stood_there_before() -> None:
    """What is inside of it, from where that one ended, would be a request."""
    bus = known(7)
    bus.send(OURS).requests()
    inside = encode_adu(7, P.write_registers_request(0, b"\x00" + COMMAND + bytes(9)))
    assert inside.index(COMMAND) == len(OURS)
    assert bus.send(inside + encode_adu(7, READ) * (MOST_BYTES // len(OURS))).requests() == []


@pytest.mark.parametrize("behind", [ODD + bytes(9), b"\x2b\x0d\x00"])
def test_a_checksum_that_fits_by_chance_ends_no_frame_while_a_long_one_comes(behind: bytes) -> None:
    """Where a slow adapter parts a write of many registers, what comes next may begin as a function that nobody knows: behind
    the pause a checksum fitted in one of some thousand such writes, and what had come before was dropped as noise."""
    by_chance = encode_adu(92, behind)
    pdu = P.write_registers_request(0, bytes(range(40, 80)) + by_chance + b"\xf8" * (200 - len(by_chance)))
    request, first = encode_adu(1, pdu), 7 + 40
    cuts = [first, first + len(by_chance) + 3, first + 100]
    pieces = [request[a:b] for a, b in zip([0, *cuts], [*cuts, len(request)], strict=True)]
    assert Bus().send(*pieces, pause_s=0.01).requests() == answered(pdu)


def test_a_function_that_nobody_knows_is_heard_behind_a_frame_that_was_cut_off() -> None:
    cut = encode_adu(1, P.write_registers_request(0, bytes(range(100))))[:30]
    assert Bus().send(cut, encode_adu(1, ODD), pause_s=0.01).requests() == answered(ODD)


@pytest.mark.parametrize("baud", [4800, 9600, 19200])
def test_a_master_that_pauses_between_its_characters_is_heard_through_a_slow_adapter(baud: int) -> None:
    """1.5 characters are silent between any two, as they may be (section 2.5.1.1): a long write was given up in its middle."""
    long = encode_adu(1, P.write_registers_request(0, bytes(240)))
    byte_s = 2.5 * 11 / baud
    size = int(0.016 / byte_s)
    bus = Bus(baud=baud).send(*(long[at : at + size] for at in range(0, len(long), size)), pause_s=size * byte_s)
    assert bus.requests() == answered(long[1:-2])


@pytest.mark.parametrize("around", [INSIDE, encode_adu(7, P.write_registers_request(0, bytes(2) + COMMAND + bytes(2)))])
def test_a_request_that_an_adapter_parts_from_the_frame_around_it_on_both_sides_is_none(around: bytes) -> None:
    at = around.index(COMMAND)
    end = at + len(COMMAND)
    for head in ((around[:at],), (around[:4], around[4:at]), (around[:3], around[3:5], around[5:at])):
        assert known(7).send(*head, around[at:end], around[end:], pause_s=0.015).requests() == [], head


def test_a_request_behind_a_frame_of_another_that_was_cut_off_waits_for_its_rest_and_is_answered() -> None:
    bus = known(7).send(INSIDE[:5], pause_s=0.005)
    begin_s = bus.now_s
    assert bus.send(OURS).pause(1.0).heard == [(begin_s + SPLIT_S, RtuRequest(1, READ, True))]


def test_a_frame_whose_pieces_all_come_late_has_its_time_only_in_more_than_ten() -> None:
    """A program that was late each time has heard ten pieces and no more, whatever it says of when they came."""
    for pieces, heard in ((10, answered(MANY)), (11, [])):
        frame = encode_adu(1, MANY)
        cuts = [*range(pieces), len(frame)]
        bus = Bus(baud=115200).send(*(frame[at:end] for at, end in pairwise(cuts)), pause_s=0.0195)
        assert bus.requests() == heard, pieces


def test_of_requests_that_had_to_make_room_the_last_eight_are_carried_out() -> None:
    """Sixty without a silence between them, by a program that waits for no answer: the newest are what it wants now."""
    receiver = RtuReceiver(1, BAUD, CHARACTER_S, may_echo=True)
    requests = [P.write_register_request(1, number) for number in range(MOST_BYTES // 8 + 1)]
    receiver.receive(b"".join(encode_adu(1, request) for request in requests), 0.0)
    taken = receiver.take(1.0)
    assert [request.pdu for request in taken] == requests[-8:] and not any(request.is_answered for request in taken)


def test_a_stop_to_everybody_is_carried_out_though_long_writes_have_to_make_room_behind_it() -> None:
    """Nobody says a broadcast again."""
    stop, long = P.write_register_request(0, 0), P.write_registers_request(200, bytes(200))
    bus = Bus().send(encode_adu(0, stop) + 3 * encode_adu(1, long))
    assert [request.pdu for request in bus.requests()] == [stop, long, long, long]
