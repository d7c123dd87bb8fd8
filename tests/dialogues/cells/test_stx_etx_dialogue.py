"""Frames between STX and ETX, as Rinstrum's R300 prints its automatic output, and the tabs of an HX711 sketch."""

from dataclasses import replace
from math import inf

import pytest

from gateway.devices import DeviceProfile, cell_device, cell_host
from gateway.devices.checksum import add_checksum
from gateway.devices.force_reading import ForceReading
from gateway.devices.messages import ForceSample, Garbage, Quality
from tests.dialogues.cells.test_overload_dialogue import cell

WORDS = dict.fromkeys("OUE", Quality.OVERLOAD) | {"G": Quality.OK, "N": Quality.OK, "M": Quality.UNSTABLE}
RINSTRUM = cell(
    terminator="\x03",
    stream=ForceReading(frame="\x02{force:8.2f}{status:G|N|M|O|U|E}", unit="N", quality=WORDS, rate_hz=10.0),
)
WITH_UNIT = cell(
    terminator="\x03",
    stream=ForceReading(frame="\x02{force:8.2f} {unit:N|kg}", unit="N", overload=("\x02------",), rate_hz=10.0),
)
ENDS_WITH_A_LINE = cell(
    terminator="\r\n", stream=ForceReading(frame="\x02{force:8.2f} {unit:N|kg}\x03", unit="N", rate_hz=10.0)
)
SKETCH = cell(
    terminator="\r\n",
    stream=ForceReading(frame="one reading:\t{one:.1f}\t| average:\t{force:.5f}", unit="N", rate_hz=10.0),
)
RICE_LAKE = cell(  # Revolution 680, page 63: STX, polarity, 7 characters, unit, G/N, status (a blank is valid), CR LF
    terminator="\r\n",
    stream=ForceReading(
        frame="\x02{force:8.2f}K{mode:G|N}{status: |M|Z|I|O}",
        unit="N",
        quality=dict.fromkeys("IO", Quality.OVERLOAD) | {" ": Quality.OK, "Z": Quality.OK, "M": Quality.UNSTABLE},
        rate_hz=20.0,
    ),
)
YAOHUA = replace(  # XK3190-A23p, page 24: STX, address, command, exclusive or of both, ETX
    cell(terminator="\x03", read_force=ForceReading(ask="\x02AB", frame="\x02AB{force:+07d}2", unit="N", rate_hz=20.0)),
    checksum="xor-hex",
)
LAUMAS_FAST = replace(  # TLB, fast continuous transmission, TD: the sum is that of what stands between & and \
    cell(terminator="\r", stream=ForceReading(frame="&T{force:06d}P{peak:06d}\\", unit="N", rate_hz=300.0)),
    checksum="xor-hex",
)

LAUMAS_ASKED = replace(  # W100, ASCII protocol: what stands between $ or & and the sum, without a \\, counts
    cell(
        terminator="\r",
        constants={"address": 1},
        read_force=ForceReading(ask="${address:02d}t", frame="&{address:02d}{force:06d}t\\", newton_per_count=0.1),
    ),
    checksum="xor-hex",
)


def test_a_leading_dollar_is_no_part_of_an_exclusive_or() -> None:
    assert cell_host(LAUMAS_ASKED).poll() == b"$01t75\r"
    assert cell_device(LAUMAS_ASKED).receive(b"$01t75\r", 0.0) == 1
    assert add_checksum(b"$GPGLL,5057.970,N,00146.110,E,142451,A", "xor").endswith(b"A*27")  # NMEA 0183


def test_a_question_with_an_exclusive_or_in_digits_is_the_manual_s() -> None:
    assert cell_host(YAOHUA).poll() == bytes.fromhex("02 41 42 30 33 03")
    assert cell_device(YAOHUA).receive(bytes.fromhex("02 41 42 30 33 03"), 0.0) == 1
    for command, digits in ((b"A", b"00"), (b"C", b"02"), (b"D", b"05"), (b"E", b"04"), (b"F", b"07")):
        assert add_checksum(b"\x02A" + command, "xor-hex") == b"\x02A" + command + digits


@pytest.mark.parametrize(
    ("profile", "frame", "raw", "quality"),
    [
        (RINSTRUM, b"\x02   12.34G\x03", 12.34, Quality.OK),
        (RINSTRUM, b"\x02-   0.20M\x03", -0.2, Quality.UNSTABLE),
        (RINSTRUM, b"\x02 9999.99O\x03", 9999.99, Quality.OVERLOAD),
        (WITH_UNIT, b"\x02+  12.34 N\x03", 12.34, Quality.OK),
        (RICE_LAKE, b"\x02   12.34KG \r\n", 12.34, Quality.OK),
        (RICE_LAKE, b"\x02-   0.52KGM\r\n", -0.52, Quality.UNSTABLE),
        (RICE_LAKE, b"\x02   99.99KGO\r\n", 99.99, Quality.OVERLOAD),
        (YAOHUA, b"\x02AB+00123421E\x03", 1234.0, Quality.OK),
        (LAUMAS_FAST, b"&T000123P000123\\04\r", 123.0, Quality.OK),  # T xor P; the digits cancel out
        (LAUMAS_FAST, b"&T-00012P000012\\19\r", -12.0, Quality.OK),  # and - xor 0
        (WITH_UNIT, b"\x02------\x03", inf, Quality.OVERLOAD),
        (ENDS_WITH_A_LINE, b"\x02+  12.34 N\x03\r\n", 12.34, Quality.OK),
        (SKETCH, b"one reading:\t12.3\t| average:\t12.34000\r\n", 12.34, Quality.OK),
    ],
)
def test_a_frame_is_read_as_printed(profile: DeviceProfile, frame: bytes, raw: float, quality: Quality) -> None:
    assert cell_host(profile).receive(frame, 7.0) == [ForceSample(raw, raw, quality, 7.0)]


@pytest.mark.parametrize(
    ("profile", "frame"),
    [
        (RINSTRUM, b"   12.34G\x03"),  # its STX is lost
        (RINSTRUM, b"\x02\x02   12.34G\x03"),
        (RINSTRUM, b"\x02   12.34X\x03"),
        (RICE_LAKE, b"\x02   12.34LG \r\n"),
        (YAOHUA, b"\x02AB+00123521E\x03"),
        (LAUMAS_FAST, b"&T000124P000123\\04\r"),
        (WITH_UNIT, b"\x02+  12.34\tN\x03"),
        (ENDS_WITH_A_LINE, b"\x02+  12.34 N\r\n"),
        (SKETCH, b"one reading: 12.3 | average: 12.34000\r\n"),
    ],
)
def test_anything_else_is_garbage_and_counted_whole(profile: DeviceProfile, frame: bytes) -> None:
    assert cell_host(profile).receive(frame, 7.0) == [Garbage(frame)]


@pytest.mark.parametrize(
    ("profile", "force_n", "frame"),
    [
        (RINSTRUM, 12.34, b"\x02   12.34G\x03"),
        (RINSTRUM, 1e9, b"\x02 9999.99O\x03"),
        (WITH_UNIT, -12.34, b"\x02  -12.34 N\x03"),
        (WITH_UNIT, 1e9, b"\x02------\x03"),
        (ENDS_WITH_A_LINE, 12.34, b"\x02   12.34 N\x03\r\n"),
        (RICE_LAKE, 12.34, b"\x02   12.34KG \r\n"),
        (YAOHUA, 1234.0, b"\x02AB+00123421E\x03"),
        (LAUMAS_FAST, 123.0, b"&T000123P000000\\04\r"),
        (SKETCH, 12.34, b"one reading:\t0.0\t| average:\t12.34000\r\n"),
    ],
)
def test_the_simulated_device_prints_so(profile: DeviceProfile, force_n: float, frame: bytes) -> None:
    assert cell_device(profile).frame(force_n) == frame
