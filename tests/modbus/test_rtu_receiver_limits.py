"""Where the receiver's decisions end: the shortest silence, stray bytes, frames across a silence, and what is forgotten."""

from gateway.modbus import pdu as P  # noqa: N812
from gateway.modbus.rtu import encode_adu
from gateway.modbus.rtu_receiver import MOST_BYTES, RtuRequest
from tests.modbus.rtu_bus import SILENCE_S, Bus
from tests.modbus.test_rtu_receiver import COMMAND, INSIDE, OURS, READ, WRITE, answered


def test_a_silence_is_one_from_its_first_moment() -> None:
    """What begins behind it counts, also where the line is known for the unit whose frame was cut off before."""
    begun = encode_adu(2, P.write_registers_request(0, bytes(40)))[:7]
    for silences, heard in ((0.5, []), (1.05, answered())):
        bus = Bus()
        assert bus.send(encode_adu(2, READ)).requests() == []
        assert bus.send(begun, OURS, pause_s=silences * SILENCE_S).requests() == heard, silences


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
    assert Bus().send(made, OURS, pause_s=0.006).requests() == answered()


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


def test_where_silences_were_is_forgotten_with_the_port() -> None:
    at = INSIDE.index(COMMAND)
    bus = Bus().send(b"\x07" * at, b"\x07", pause_s=0.006)
    bus.receiver.forget()
    assert bus.send(INSIDE[:-1] + b"\x55").requests() == []


def test_a_request_with_more_bytes_than_it_says_is_none() -> None:
    for pdu in (WRITE, READ, P.write_registers_request(0, bytes(4))):
        assert Bus().send(encode_adu(1, pdu + bytes(2))).requests() == []
