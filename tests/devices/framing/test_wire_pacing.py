"""The simulated wire: bytes take the time that the baud rate takes, and a wrong speed makes garbage."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.devices import PacedWire, SerialSettings, resample_at_baud
from gateway.devices.wire import MOST_QUEUED_BYTES


def test_a_byte_is_through_when_its_last_bit_has_passed() -> None:
    wire = PacedWire(9600)
    wire.send(b"SET 512\r\n", 1.0)
    assert wire.bytes_through(1.0) == b""
    assert wire.bytes_through(1.0 + 10 / 9600 - 1e-9) == b""
    assert wire.bytes_through(1.0 + 10 / 9600) == b"S"
    assert wire.last_through_s == pytest.approx(1.0 + 9 * 10 / 9600)
    assert wire.bytes_through(2.0) == b"ET 512\r\n"
    assert wire.last_through_s is None


def test_a_write_waits_for_the_one_before_it() -> None:
    wire = PacedWire(9600)
    wire.send(b"ab", 0.0)
    wire.send(b"cd", 0.0001)
    assert wire.last_through_s == pytest.approx(40 / 9600)
    assert wire.bytes_through(40 / 9600) == b"abcd"
    wire.send(b"e", 1.0)
    assert wire.last_through_s == pytest.approx(1.0 + 10 / 9600)


@given(st.lists(st.tuples(st.binary(min_size=1, max_size=20), st.floats(0, 0.02)), max_size=10), st.floats(1e-4, 5e-3))
def test_looking_more_often_changes_nothing(writes: list[tuple[bytes, float]], look_s: float) -> None:
    """Order is kept, nothing is early, and the last byte comes when a patient observer sees it too."""
    patient, hasty = PacedWire(9600), PacedWire(9600)
    now_s, seen = 0.0, b""
    for data, pause_s in writes:
        patient.send(data, now_s)
        hasty.send(data, now_s)
        until_s = now_s + pause_s
        while now_s + look_s < until_s:
            now_s += look_s
            seen += hasty.bytes_through(now_s)
        now_s = until_s
    assert seen + hasty.bytes_through(now_s + 10.0) == b"".join(data for data, _ in writes)
    assert len(seen) <= now_s / (10 / 9600) + 1
    assert patient.bytes_through(now_s + 10.0) == b"".join(data for data, _ in writes)


def test_a_parity_bit_takes_its_time_too() -> None:
    assert SerialSettings(baud=9600, parity="even").bits_per_character == 11
    assert SerialSettings(baud=9600, data_bits=7, stop_bits=2).bits_per_character == 10
    assert SerialSettings(baud=9600).character_s == pytest.approx(10 / 9600)
    assert str(SerialSettings(baud=9600)) == "9600 8N1"
    assert str(SerialSettings(baud=9600, data_bits=7, parity="even").at(19200)) == "19200 7E1"


def test_the_wire_does_not_grow_without_bound() -> None:
    wire = PacedWire(9600)
    wire.send(b"x" * (MOST_QUEUED_BYTES + 5), 0.0)
    assert (wire.room, wire.dropped_bytes) == (0, 5)


@given(st.binary(max_size=60))
def test_the_same_speed_hears_what_was_sent(data: bytes) -> None:
    assert resample_at_baud(data, 9600, 9600) == data
    assert resample_at_baud(data, 9600, 9700) == data  # 1 % off: within what a UART tolerates over one character


@pytest.mark.parametrize(
    ("sent", "heard"), [(9600, 115200), (115200, 9600), (9600, 19200), (19200, 9600), (38400, 9600)]
)
@pytest.mark.parametrize("line", [b"ST,GS,+0012.34kg\r\n", b"SET 512\r\n", b"512\r\n", b"0\r\n"])
def test_another_speed_hears_garbage_and_always_the_same(line: bytes, sent: int, heard: int) -> None:
    garbage = resample_at_baud(line * 20, sent, heard)
    assert garbage == resample_at_baud(line * 20, sent, heard)
    assert line not in garbage
    assert b"\r\n" not in garbage


def test_an_end_that_is_set_to_0_baud_has_hung_up_and_a_slow_one_is_heard_within_bounds() -> None:
    """`stty 0` on the terminal of a serial face ended the gateway at its next answer, and stopped it for good at the next
    byte; 64 bytes at 50 baud were 140 000, a third of a second of the control loop."""
    assert resample_at_baud(b"answer", 9600, 0) == b""
    assert len(resample_at_baud(bytes(64), 50, 115200)) == MOST_QUEUED_BYTES
    assert resample_at_baud(b"request", 0, 9600) == b""
