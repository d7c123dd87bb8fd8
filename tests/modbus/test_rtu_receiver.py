"""What one unit hears on an RTU bus: its requests, each once, and nothing of what is others' or noise."""

import random
import struct
from itertools import product

import pytest

from gateway.modbus import pdu as P  # noqa: N812
from gateway.modbus.rtu import encode_adu
from gateway.modbus.rtu_receiver import MOST_BYTES, SPLIT_S, RtuReceiver, RtuRequest
from tests.modbus.host_answers import identification_request, loopback_request, report_request
from tests.modbus.rtu_bus import SILENCE_S, Bus

READ = P.read_request(3, 100, 12)
WRITE = P.write_register_request(1, 1200)
PDUS = [
    READ,
    WRITE,
    P.read_request(1, 0, 16),
    bytes.fromhex("05 0000 ff00"),
    bytes.fromhex("0f 0000 000b 02 ff07"),
    P.write_registers_request(0, bytes(range(40))),
    P.mask_write_request(0, 1, 2),
    P.read_write_request(100, 12, 0, bytes(8)),
    loopback_request(b"\xa5\x37"),
    loopback_request(bytes(20)),
    report_request(),
    identification_request(1),
    b"\x41\x01\x02",  # a function that nobody knows
    b"\x2b\x0d\x00\x10\x00",  # another interface of function 43, refused like one, and no noise
]
OF_ANY_LENGTH = (loopback_request(bytes(20)), *PDUS[-2:])
OURS = encode_adu(1, READ)
COMMAND = encode_adu(1, WRITE)


def answered(pdu: bytes = READ) -> list[RtuRequest]:
    return [RtuRequest(1, pdu, True)]


def registers_answer(unit: int, data: bytes) -> bytes:
    return encode_adu(unit, bytes((3, len(data))) + data)


@pytest.mark.parametrize("pdu", PDUS, ids=lambda pdu: pdu.hex()[:12])
def test_a_request_is_heard_once_when_the_line_is_silent(pdu: bytes) -> None:
    bus = Bus()
    begin_s = bus.now_s
    assert bus.send(encode_adu(1, pdu)).pause(0.99 * SILENCE_S).heard == []
    assert bus.pause(0.02 * SILENCE_S).heard == [(begin_s + SILENCE_S, RtuRequest(1, pdu, True))]
    assert bus.requests() == answered(pdu) and bus.requests() == []


def test_the_silence_is_that_of_the_specification() -> None:
    """3.5 characters of eleven bits up to 19200 baud, 1.75 ms above."""
    for baud, silence_s in ((1200, 38.5 / 1200), (9600, 38.5 / 9600), (19200, 38.5 / 19200), (115200, 1.75e-3)):
        bus = Bus(baud=baud)
        begin_s = bus.now_s
        ((heard_s, _),) = bus.send(OURS).pause(1.0).heard
        assert heard_s - begin_s == pytest.approx(silence_s)


@pytest.mark.parametrize("pdu", [pdu for pdu in PDUS[:-2] if pdu[0] != 8], ids=lambda pdu: pdu.hex()[:12])
def test_a_frame_in_two_reads_is_one_frame(pdu: bytes) -> None:
    frame = encode_adu(1, pdu)
    for cut in range(1, len(frame)):
        assert Bus().send(frame[:cut], frame[cut:], pause_s=0.016).requests() == answered(pdu), cut


def test_a_frame_that_comes_byte_by_byte_is_one_frame() -> None:
    assert Bus().send(*(bytes((byte,)) for byte in COMMAND), pause_s=0.016).requests() == answered(WRITE)


@pytest.mark.sampled
@pytest.mark.parametrize("cut", [*range(5, 105), 119, 140])
def test_a_request_full_of_zeros_and_small_floats_is_one_frame_in_three_reads(cut: int) -> None:
    """As an upload's are. 34 zeros before a float of 0.5 to 2 are a frame to everybody, of function 0, by their checksum; and
    some float's bytes can begin no frame, so that behind a pause nothing seems to be awaited."""
    branch = struct.pack(">19f", 0.965, 46.86, 70.84, *[0.0] * 13, 1.0, 0.77, 0.567)
    shares = struct.pack(">7f", 0.0207, 0.0169, 0.266, -1e9, -1e9, 0.0304, 0.103)
    for values in (branch + bytes(52) + struct.pack(">f", 0.9654), bytes(60) + shares):
        pdu = P.write_registers_request(1070, values)
        frame = encode_adu(1, pdu)
        for second in range(cut + 1, len(frame)):
            taken = Bus().send(frame[:cut], frame[cut:second], frame[second:], pause_s=0.01).requests()
            assert taken == answered(pdu), (cut, second)


@pytest.mark.parametrize("pdu", PDUS, ids=lambda pdu: pdu.hex()[:12])
def test_other_units_are_left_alone_and_everybody_is_obeyed_without_an_answer(pdu: bytes) -> None:
    assert Bus().send(encode_adu(7, pdu)).requests() == []
    heard = [] if pdu in OF_ANY_LENGTH else [RtuRequest(0, pdu, False)]
    assert Bus().send(encode_adu(0, pdu)).requests() == heard


def test_a_broadcast_and_the_next_request_in_one_read_are_two() -> None:
    assert Bus().send(encode_adu(0, WRITE) + OURS).requests() == [RtuRequest(0, WRITE, False), *answered()]


def test_a_request_is_heard_whole_whose_first_bytes_come_with_a_broadcast_or_another_s_frame() -> None:
    """One or two bytes are stray behind a request that is answered, for its master waits; behind others the next may begin."""
    for before in (encode_adu(0, WRITE), encode_adu(0, READ), COMMAND + encode_adu(7, WRITE)):
        for first in (1, 2, 3):
            heard = Bus().send(before + OURS[:first], OURS[first:], pause_s=0.01).requests()
            assert heard[-1:] == answered(), (before.hex(), first)


def test_an_older_request_is_executed_but_only_the_last_is_answered() -> None:
    """Its master has given up: what comes now would be taken for the answer to the other."""
    assert Bus().send(COMMAND + OURS).requests() == [RtuRequest(1, WRITE, False), *answered()]
    assert Bus().send(COMMAND + encode_adu(7, READ)).requests() == [RtuRequest(1, WRITE, False)]


def test_behind_a_stray_byte_whole_frames_are_heard_however_many_follow() -> None:
    """All of them are frames to the end of the burst: so the first is no chance."""
    for behind in (1, 2, 3):
        assert Bus().send(b"\x55" + COMMAND + behind * encode_adu(7, WRITE)).requests() == [RtuRequest(1, WRITE, False)]
        assert Bus().send(b"\x55" + COMMAND + behind * encode_adu(7, WRITE) + b"\x55").requests() == []


FOREIGN = {
    "a read": encode_adu(7, READ) + registers_answer(7, bytes(24)),
    "a short answer": encode_adu(7, P.read_request(3, 1, 1)) + registers_answer(7, b"\x01\x06"),
    "a write": 2 * encode_adu(7, WRITE),
    "many": encode_adu(7, P.write_registers_request(3, bytes(60))) + encode_adu(7, bytes.fromhex("10 0003 001e")),
    "a refusal": encode_adu(7, READ) + encode_adu(7, b"\x83\x02"),
    "who": encode_adu(7, report_request()) + encode_adu(7, b"\x11\x05\x01\xff\x03\x10\x20"),
    "a read and write": encode_adu(7, P.read_write_request(3, 4, 5, bytes(6))) + encode_adu(7, b"\x17\x08" + bytes(8)),
    "a function of its own": encode_adu(7, b"\x41\x02\x03\x04"),
}
INSIDE = registers_answer(7, b"\x00\x07" + COMMAND + b"\x00\x09")


@pytest.mark.parametrize("traffic", FOREIGN.values(), ids=FOREIGN)
def test_what_others_say_to_each_other_neither_acts_nor_hides_what_follows(traffic: bytes) -> None:
    assert Bus().send(traffic).requests() == []
    assert Bus().send(traffic + OURS).requests() == answered()
    assert Bus().send(traffic, OURS, pause_s=SILENCE_S).requests() == answered()
    for cut in range(1, len(traffic)):
        bus = Bus().send(traffic[:cut], traffic[cut:], pause_s=0.016)
        assert bus.send(OURS).requests() == answered(), cut


def test_a_request_inside_of_another_s_answer_is_no_request() -> None:
    assert Bus().send(INSIDE).requests() == []
    for cut in range(1, len(INSIDE)):
        assert Bus().send(INSIDE[:cut], INSIDE[cut:], pause_s=0.5e-3).requests() == [], cut
    assert Bus().send(encode_adu(7, READ) + INSIDE + OURS).requests() == answered()


def test_nor_is_it_one_when_an_adapter_hands_that_answer_over_in_two_pieces() -> None:
    """Also where the second piece begins with it: the whole answer has its checksum, and in doubt nothing is done."""
    for cut in range(1, len(INSIDE)):
        bus = Bus().send(INSIDE[:cut], INSIDE[cut:], pause_s=0.016)
        assert bus.requests() == [] and bus.send(OURS).requests() == answered(), cut


def test_nor_is_it_one_when_that_answer_is_cut_off() -> None:
    """Its unit was heard, at the latest in the request that it answers."""
    for cut in range(1, len(INSIDE)):
        bus = Bus().send(encode_adu(7, READ) + INSIDE[:cut])
        assert bus.requests() == [] and bus.send(OURS).requests() == answered(), cut
        assert bus.send(INSIDE[:cut]).requests() == [] and bus.send(OURS).requests() == answered(), cut


def test_nor_is_it_one_when_that_answer_is_damaged() -> None:
    for place, bits in product(range(len(INSIDE)), (0x01, 0x04, 0x15, 0x40, 0x80, 0xFF)):
        damaged = bytearray(INSIDE)
        damaged[place] ^= bits
        bus = Bus().send(bytes(damaged))
        assert bus.requests() == [] and bus.send(OURS).requests() == answered(), place
    bus = Bus().send(b"\x00" + INSIDE[:-1] + b"\x00")
    assert bus.requests() == [] and bus.send(OURS).requests() == answered()


@pytest.mark.parametrize("stray", [b"\x00", b"\xff", b"\xfe", b"\x00\x00", b"\x01", b"\x07"], ids=bytes.hex)
@pytest.mark.parametrize("unit", [1, 3, 5, 6, 15, 16, 247])
def test_the_stray_byte_of_a_line_without_bias_costs_nothing(unit: int, stray: bytes) -> None:
    for pdu in (READ, WRITE, P.write_registers_request(0, bytes(8))):
        frame = encode_adu(unit, pdu)
        for burst in (stray + frame, frame + stray):
            assert Bus(unit=unit).send(burst).requests() == [RtuRequest(unit, pdu, True)]


def test_half_a_request_does_not_keep_the_next_one_from_being_heard() -> None:
    long = encode_adu(1, P.write_registers_request(0, bytes(100)))
    for half in (OURS[:5], long[:40], INSIDE[:6], b"\x07\x03\xf0"):
        for pause_s in (1.01 * SILENCE_S, 0.5 * SPLIT_S, 2 * SPLIT_S):
            bus = Bus().send(half, OURS, pause_s=pause_s)
            assert bus.requests() == answered(), (half.hex(), pause_s)


def test_a_late_program_reads_half_a_request_and_the_next_in_one_piece() -> None:
    """And a frame of a unit that is not on this line; one that is on it would cover what follows it."""
    long = encode_adu(1, P.write_registers_request(0, bytes(100)))
    for half in (OURS[:5], long[:40], INSIDE[:7]):
        bus = Bus().send(half + OURS)
        assert bus.pause(0.9 * SPLIT_S).heard == [] or half == OURS[:5], "the rest of it may come yet"
        assert bus.requests() == answered(), half.hex()
    assert Bus().send(encode_adu(7, READ) + INSIDE[:7] + OURS).requests() == []


def test_a_frame_that_noise_makes_of_a_request_s_beginning_does_not_hide_it() -> None:
    made = bytes.fromhex("f834 bbb2 effc 4e81")  # effc 4e81 01 is a refusal with its checksum
    assert Bus().send(made, OURS, pause_s=0.006).requests() == answered()
    assert Bus().send(made + OURS).requests() == answered()


def noise(draw: random.Random) -> bytes:
    """What a line makes: anything; bytes like those of frames; a frame cut or damaged."""
    frame = bytearray(draw.choice((OURS, COMMAND, INSIDE, *FOREIGN.values(), encode_adu(1, PDUS[5]))))
    kind = draw.randrange(4)
    if kind == 0:
        return draw.randbytes(draw.randint(1, 40))
    if kind == 1:
        return bytes(draw.choice((0, 1, 3, 6, 7, 16, 0x83, 255)) for _ in range(draw.randint(1, 40)))
    if kind == 2:
        return bytes(frame[: draw.randrange(1, len(frame))])
    frame[draw.randrange(len(frame))] ^= draw.randint(1, 255)
    return bytes(frame)


def is_frame(data: bytes) -> bool:
    """What was damaged may be another's frame, or ours, by chance of the checksum."""
    return bool(Bus().send(data).requests())


def test_noise_costs_at_most_the_request_that_it_touches(budget: int) -> None:
    draw = random.Random(14)
    bus = Bus()
    touched = lost = 0
    for _ in range(500 * budget):
        made = noise(draw)
        if is_frame(made):
            continue
        pattern = draw.randrange(4)
        if pattern == 0:  # alone on the line, some pause before the next request
            bus.send(made, pause_s=draw.uniform(SILENCE_S, 0.1))
        else:
            cut = draw.randrange(1, len(OURS))
            burst = (made + OURS, OURS[:cut] + made + OURS[cut:], OURS + made)[pattern - 1]
            taken = bus.send(burst).requests()
            assert all(request.pdu == READ for request in taken)
            touched, lost = touched + 1, lost + (not taken)
        taken = bus.send(COMMAND).requests()
        assert taken[-1:] == answered(WRITE), (pattern, made.hex())
        assert {request.pdu for request in taken} <= {WRITE}
    assert 0 < lost < 0.6 * touched


def test_nothing_is_held_without_bound() -> None:
    draw = random.Random(3)
    bus = Bus()
    for _ in range(200):
        bus.send(draw.randbytes(100), pause_s=0.1e-3)
        assert len(bus.receiver._burst) <= MOST_BYTES
    assert bus.receiver.noise_bytes > 19_000
    bus.pause(1.0)
    assert bus.send(OURS).requests()[-1:] == answered()


def test_a_busy_bus_without_visible_silence_is_followed() -> None:
    bus = Bus()
    for _ in range(100):
        bus.send(FOREIGN["a read"], pause_s=0.1e-3)
    assert bus.send(OURS).requests() == answered() and bus.receiver.noise_bytes == 0
    assert bus.receiver.frames == 201


def test_behind_a_plug_may_be_another_bus() -> None:
    """Bytes that begin a frame of a unit which this line is known for hide what may be inside of it."""
    hidden = P.write_registers_request(0, bytes(40))
    begun = encode_adu(2, hidden)[:7] + OURS
    for is_replugged in (False, True):
        bus = Bus()
        assert bus.send(encode_adu(2, READ)).requests() == []
        if is_replugged:
            bus.receiver.forget()
        assert bus.send(begun).requests() == (answered() if is_replugged else [])


def test_what_is_passed_over_in_noise_could_begin_nothing() -> None:
    """Held against the slow way: each place by itself, a silence before it or not."""
    for seed in range(40):
        chance = random.Random(seed)
        receiver = RtuReceiver(1, 19200, 11 / 19200, may_echo=True)
        frames = [encode_adu(chance.randrange(1, 9), pdu) for pdu in chance.sample(PDUS, 3)]
        for part in (chance.randbytes(20), frames[0], chance.randbytes(9), frames[1][:-1], frames[2]):
            receiver.receive(part, (receiver.deadline_s or 0.0) + chance.choice((-0.001, 0.001)))
        last, begun = len(receiver._burst) - 1, set[int]()
        at = receiver._next_beginning(0)
        while at < last:
            begun.add(at)
            at = receiver._next_beginning(at + 1)
        for place in set(range(last)) - begun:
            assert place not in receiver._marks, seed
            assert receiver._frame_size(place, is_start=False) == 0, seed
            assert receiver._claimed_end(place) == place, seed
