"""Frames of load cells that no shipped profile is for, as their makers print them: the sign apart from its digits, units padded
to a column, lines that begin with LF, questions that begin with ESC, numbers with an exponent."""

from dataclasses import replace
from math import inf

import pytest

from gateway.devices import DeviceProfile, TemplateError, cell_device, cell_host
from gateway.devices.checksum import add_checksum
from gateway.devices.force_reading import ForceReading
from gateway.devices.messages import ForceSample, Garbage, Quality
from gateway.devices.rehearsal import rehearse
from tests.dialogues.cells.test_overload_dialogue import cell

OK, UNSTABLE, OVERLOAD = Quality.OK, Quality.UNSTABLE, Quality.OVERLOAD
KG_N, GRAM_N, POUND_N = 9.80665, 0.00980665, 4.4482216152605

KERN = cell(  # `w`: stability, sign, 9 characters, blank, unit
    read_force=ForceReading(
        ask="w",
        frame="{status: |S}{sign: |-}{force:9.3f} {unit:kg|g } ",
        unit="kg",
        quality={" ": UNSTABLE, "S": OK},
        overload=("    Error   ",),
    )
)
SARTORIUS = cell(  # SBI, 16 characters; no unit while the weight moves; H above, L below the range
    read_force=ForceReading(
        ask="\x1bP",
        frame="{force:+10.1f} {status:g  |   }",
        unit="g",
        quality={"g  ": OK, "   ": UNSTABLE},
        overload=("      H       ",),
        underload=("      L       ",),
    )
)
SMA = cell(  # SCP-0499 in the manuals of Cardinal 190 (page 79) and Sartorius PR 5211 (page 51)
    terminator="\r",
    read_force=ForceReading(
        ask="\nW",
        frame="\n{status: |Z|O|U}1{mode:G|N}{motion: |M} {force:10.3f}{unit:lb |kg |g  }",
        unit="kg",
        quality={" ": OK, "Z": OK, "O": OVERLOAD, "U": OVERLOAD},
    ),
)
RADWAG = cell(  # PS series, page 82: command, stability, sign, 9 characters, unit of 3
    read_force=ForceReading(
        ask="SUI",
        frame="SUI{status: |?|^|v} {sign: |-}{force:9.3f} {unit:g  |kg |N  }",
        unit="g",
        quality={" ": OK, "?": UNSTABLE, "^": OVERLOAD, "v": OVERLOAD},
    )
)
NCI = cell(  # Adam Equipment MDW: LF, weight and unit, CR LF, status, CR ETX
    terminator="\r\x03",
    read_force=ForceReading(
        ask="W",
        frame="\n{force:7.2f}{unit:kg|lb}\r\n{status:000|100|010}",
        unit="kg",
        quality={"000": OK, "010": OK, "100": UNSTABLE},
        overload=("\n^^^^^^^kg\r\n000",),
    ),
)
YAOHUA_A12 = replace(  # XK3190-A12E, page 12: the exclusive or of bytes 1 to 11, as two digits
    cell(
        stream=ForceReading(
            frame="W{mode:G|N}{force:7.3f}kg",
            unit="kg",
            overload=("         OL",),
            underload=("         LO",),
            rate_hz=10.0,
        )
    ),
    checksum="xor-hex",
)
FLINTEC = replace(  # FT-10, page 46: address, command, S steady or D dynamic, sign and weight, E an error
    cell(
        read_force=ForceReading(
            ask="{address:02d}X",
            frame="{address:02d}X{status:S|D}{force:+09.2f}",
            unit="kg",
            quality={"S": OK, "D": UNSTABLE},
            overload=("{address:02d}XE",),
        ),
        constants={"address": 1},
    ),
    checksum="sum-complement",
)
YAOHUA_A26 = cell(  # XK3190-A26, page 11, format 2: lines that begin with =, and have no other end
    terminator="=", stream=ForceReading(frame="{force:8.3f}", unit="kg", rate_hz=10.0)
)
_SWB = "0123456789:;<=>?"  # status byte B, in kilograms: bit 0 is net, 1 the minus, 2 beyond the range, 3 in motion
TOLEDO = cell(  # Mettler Toledo, continuous: STX, status bytes A (`,` is two decimals), B and C, weight, tare, CR
    terminator="\r",
    stream=ForceReading(
        frame=f"\x02,{{status:{'|'.join(_SWB)}}}{{print: |(}}{{force:06d}}{{tare:06d}}",
        newton_per_count=0.01 * KG_N,
        quality=dict.fromkeys("0123", OK) | dict.fromkeys("89:;", UNSTABLE) | dict.fromkeys("4567<=>?", OVERLOAD),
        negative=tuple("2367:;>?"),
        rate_hz=17.0,
    ),
)
EXPONENT = cell(read_force=ForceReading(ask="MEAS?", frame="{force:+.6E}", unit="N"))
COMPLEMENT = cell(  # ADAM-4016 in its hexadecimal format
    read_force=ForceReading(ask="#01", frame=">{force:+04X}", newton_per_count=0.01, end_count=32767)
)


def sample(raw: float, per_unit: float, quality: Quality = OK) -> ForceSample:
    return ForceSample(pytest.approx(raw), pytest.approx(raw * per_unit), quality, 0.0)


@pytest.mark.parametrize(
    ("profile", "line", "found"),
    [
        (KERN, b"S     2.345 kg \r\n", sample(2.345, KG_N)),
        (KERN, b"S-    2.345 kg \r\n", sample(-2.345, KG_N)),
        (KERN, b" -  200.000 g  \r\n", sample(-200.0, GRAM_N, UNSTABLE)),
        (KERN, b"S-   -2.345 kg \r\n", Garbage(b"S-   -2.345 kg \r\n")),  # which of the two minuses counts?
        (KERN, b"S     2.345 lb \r\n", Garbage(b"S     2.345 lb \r\n")),
        (KERN, b"    Error   \r\n", ForceSample(inf, inf, OVERLOAD, 0.0)),
        (SARTORIUS, b"+   1255.7 g  \r\n", sample(1255.7, GRAM_N)),
        (SARTORIUS, b"-     12.5    \r\n", sample(-12.5, GRAM_N, UNSTABLE)),
        (SARTORIUS, b"       0.0 g  \r\n", sample(0.0, GRAM_N)),
        (SARTORIUS, b"      H       \r\n", ForceSample(inf, inf, OVERLOAD, 0.0)),
        (SARTORIUS, b"      L       \r\n", ForceSample(-inf, -inf, OVERLOAD, 0.0)),
        (SARTORIUS, b"+   1255.7 kg \r\n", Garbage(b"+   1255.7 kg \r\n")),
        (SMA, b"\n 1G       5.025lb \r", sample(5.025, POUND_N)),
        (SMA, b"\n 1GM      7.650kg \r", sample(7.65, KG_N)),
        (SMA, b"\nO1G      99.999kg \r", sample(99.999, KG_N, OVERLOAD)),
        (SMA, b"\nE1G  ----------kg \r", Garbage(b"\nE1G  ----------kg \r")),
        (SMA, b"\n?\r", Garbage(b"\n?\r")),
        (RADWAG, b"SUI? -   58.237 kg \r\n", sample(-58.237, KG_N, UNSTABLE)),
        (RADWAG, b"SUI    1832.000 g  \r\n", sample(1832.0, GRAM_N)),
        (RADWAG, b"SUI^   9999.000 g  \r\n", sample(9999.0, GRAM_N, OVERLOAD)),
        (NCI, b"\n  12.34kg\r\n000\r\x03", sample(12.34, KG_N)),
        (NCI, b"\n -12.34lb\r\n100\r\x03", sample(-12.34, POUND_N, UNSTABLE)),
        (NCI, b"\n^^^^^^^kg\r\n000\r\x03", ForceSample(inf, inf, OVERLOAD, 0.0)),
        (YAOHUA_A12, b"WG004.139kg3D\r\n", sample(4.139, KG_N)),
        (YAOHUA_A12, b"WG004.139kg3C\r\n", Garbage(b"WG004.139kg3C\r\n")),
        (YAOHUA_A12, b"         OL23\r\n", ForceSample(inf, inf, OVERLOAD, 0.0)),
        (YAOHUA_A12, b"         LO23\r\n", ForceSample(-inf, -inf, OVERLOAD, 0.0)),
        (FLINTEC, b"01XS+00123.4140\r\n", sample(123.41, KG_N)),
        (FLINTEC, b"01XS+00123.4141\r\n", Garbage(b"01XS+00123.4141\r\n")),
        (FLINTEC, b"01XE02\r\n", ForceSample(inf, inf, OVERLOAD, 0.0)),
        (YAOHUA_A26, b"0003.000=", sample(3.0, KG_N)),
        (YAOHUA_A26, b"-001.000=", sample(-1.0, KG_N)),
        (YAOHUA_A26, b"000.3000=", Garbage(b"000.3000=")),  # format 1: the digits of 3.000 in reverse order
        (TOLEDO, b"\x02,0 001234000000\r", sample(1234, 0.01 * KG_N)),
        (TOLEDO, b"\x02,3   1234   500\r", sample(-1234, 0.01 * KG_N)),
        (TOLEDO, b"\x02,:(000007000000\r", sample(-7, 0.01 * KG_N, UNSTABLE)),
        (TOLEDO, b"\x02,4 999999000000\r", sample(999999, 0.01 * KG_N, OVERLOAD)),
        (TOLEDO, b"\x02,6 000012000000\r", sample(-12, 0.01 * KG_N, OVERLOAD)),
        (TOLEDO, b"\x02,2 -01234000000\r", Garbage(b"\x02,2 -01234000000\r")),  # a minus behind a minus
        (TOLEDO, b"\x02+0 001234000000\r", Garbage(b"\x02+0 001234000000\r")),  # set to one decimal
        (TOLEDO, b"\x02,  001234000000\r", Garbage(b"\x02,  001234000000\r")),  # pounds
        (EXPONENT, b"+1.234567E+01\r\n", sample(12.34567, 1.0)),
        (EXPONENT, b"-9.876543E-03\r\n", sample(-9.876543e-3, 1.0)),
        (EXPONENT, b"+9.900000E+37\r\n", sample(9.9e37, 1.0)),  # what SCPI calls infinity is over-force by its size
        (COMPLEMENT, b">07D0\r\n", sample(2000, 0.01)),
        (COMPLEMENT, b">FF80\r\n", sample(-128, 0.01)),
        (COMPLEMENT, b">7FFF\r\n", sample(32767, 0.01, OVERLOAD)),
        (COMPLEMENT, b">8000\r\n", sample(-32768, 0.01, OVERLOAD)),
    ],
)
def test_a_reading_as_it_is_printed(profile: DeviceProfile, line: bytes, found: object) -> None:
    assert cell_host(profile).receive(line, 0.0) == [found]


@pytest.mark.parametrize(
    ("profile", "asked"), [(SARTORIUS, b"\x1bP\r\n"), (SMA, b"\nW\r"), (NCI, b"W\r\x03")], ids=["esc", "lf", "cr-etx"]
)
def test_a_question_goes_out_as_it_is_printed(profile: DeviceProfile, asked: bytes) -> None:
    assert cell_host(profile).poll() == asked
    assert cell_device(profile).receive(asked, 0.0) == 1


def test_the_checksums_are_those_that_the_manual_works_out() -> None:
    assert add_checksum(b"01P", "sum-complement") == b"01P4F"
    assert add_checksum(b"01PS+000123.4", "sum-complement") == b"01PS+000123.449"


@pytest.mark.parametrize(
    "profile", [KERN, SARTORIUS, SMA, RADWAG, NCI, YAOHUA_A12, YAOHUA_A26, FLINTEC, TOLEDO, EXPONENT, COMPLEMENT]
)
def test_the_simulated_one_is_read_as_what_it_shows(profile: DeviceProfile) -> None:
    device, host = cell_device(profile), cell_host(profile)
    for force_n in (-7.5, -0.001, 0.0, 0.2, 5.0, 7.6):
        (found,) = host.receive(device.frame(force_n), 0.0)
        assert isinstance(found, ForceSample)
        assert found.force_n == pytest.approx(force_n, abs=0.51 * max(host.resolution_n, 1e-6)), device.frame(force_n)


@pytest.mark.parametrize(
    ("frame", "told"),
    [
        (
            "{sgn: |-}{force:8.2f}",
            "the minus in {sgn:...} would be read over, and a pull taken for a push: call it {sign:...}",
        ),
        ("{polarity:+|-}{force:8.2f}", "the minus in {polarity:...} would be read over"),
        ("{sign:P|M}{force:8.2f}", "{sign:...} is the sign of the force: one of its words is a minus"),
        ("{sign:1s}{force:8.2f}", "{sign:...} is the sign of the force"),
        ("{sign: |-}{force:+08.2f}", "the sign of the force stands here twice"),
        ("G+{force:06.2f}", "the sign of the force is text here, '+', and always that one: write it into the number"),
        ("{count:d},-{force:d}", "the sign of the force is text here, '-', and always that one: write it"),
        ("{force:8.2f}{units:kg|lb}", "the words of {units:...} are units, and would be read over: call it {unit:...}"),
        ("{force:8.2f}{u: kg|  g}", "the words of {u:...} are units"),
        ("{state:ST|US|OL},{force:8.2f}", "{state:...} is read over, and nothing here tells an overload"),
        ("{a:1s}{b:1s}{force:06d}", "{a:...} is read over, and nothing here tells an overload"),
        ("{force:8.2f} {bits:01X}", "{bits:...} is read over, and nothing here tells an overload"),
    ],
)
def test_a_sign_a_unit_or_an_overload_that_would_be_read_over_is_refused(frame: str, told: str) -> None:
    try:
        refused = [sentence for _, sentence in rehearse(cell(stream=ForceReading(frame=frame, unit="N", rate_hz=10.0)))]
    except TemplateError as error:
        refused = [str(error)]
    assert len(refused) == 1
    assert told in refused[0]


@pytest.mark.parametrize(
    ("frame", "unit", "told"),
    [
        ("{force:8.3f} kN", "N", "says kN, which is not unit: N; leave unit out and say newton_per_count"),
        ("{force:8.3f}kg", "N", "says kg, which is not unit: N; unit: kg"),
        ("{force:8.3f}{moves: |M} kg", "N", "says kg, which is not unit: N; unit: kg"),
        ("{force:8.3f},{moves:S|M}, lbs", "N", "says lbs, which is not unit: N; unit: lb"),
        ("{force:8.3f} lbF", "kg", "says lbF, which is not unit: kg; unit: lb"),
        ("{force:8.3f} ozF", "lb", "says ozF, which is not unit: lb; leave unit out"),
        ("{force:8.3f} lbF", "lb", ""),
        ("{force:8.3f}KG{mode:G|N}", "kg", ""),
        ("{force:8.3f}KN", "kg", ""),  # K for kilogram, N for net
        ("{force:8.3f} net", "kg", ""),
        ("{force:8.3f},{moves:S|M},N", "kg", ""),  # N for net
        ("{force:8.3f}{moves: |M}{tare:6.1f} lb", "kg", ""),  # of the other number
        ("kN {force:8.3f}", "N", ""),
    ],
)
def test_a_unit_that_is_written_behind_the_force_is_the_unit(frame: str, unit: str, told: str) -> None:
    if not told:
        ForceReading(frame=frame, unit=unit, rate_hz=10.0, overload=("OVER",))  # type: ignore[arg-type]
        return
    with pytest.raises(TemplateError) as refused:
        ForceReading(frame=frame, unit=unit, rate_hz=10.0)  # type: ignore[arg-type]
    assert told in str(refused.value)


def test_kilonewtons_are_said_by_their_size() -> None:
    profile = cell(stream=ForceReading(frame="{force:+08.4f} kN", newton_per_count=1000.0, rate_hz=10.0))
    assert cell_host(profile).receive(b"-00.0200 kN\r\n", 0.0) == [sample(-0.02, 1000.0)]


@pytest.mark.parametrize(
    "frame", ["{mode:N|G}{force:8.2f}", "{range:-|1|2}{force:8.2f}", "{mode:N| }{force:8.2f}", "{lead:>|!}{force:8.2f}"]
)
def test_words_that_say_neither_are_read_over(frame: str) -> None:
    profile = cell(stream=ForceReading(frame=frame, unit="N", rate_hz=10.0, overload=("OVER",)))
    assert [one.name for one in profile.reading.read_over(profile.constants)] == [frame[1:].split(":")[0]]


def test_longer_text_and_numbers_are_read_over_where_nothing_tells_an_overload() -> None:
    profile = cell(stream=ForceReading(frame="{time:8s} {force:8.2f} {count:d},{serial:04X}", unit="N", rate_hz=10.0))
    assert list(rehearse(profile)) == []
    (found,) = cell_host(profile).receive(b"12:34:56   -12.50 7,00AB\r\n", 0.0)
    assert found == sample(-12.5, 1.0)


def test_the_rest_of_a_bare_number_is_no_number() -> None:
    """`-184000` from its middle on is `4000`: after an opening the first line is given up where nothing marks its beginning."""
    for bare in ("{force:d}", "{force:.2f} N"):
        profile = cell(stream=ForceReading(frame=bare, unit="N", rate_hz=10.0))
        host, line = cell_host(profile), cell_device(profile).frame(-1840.0)
        host.forget()
        found = host.receive(line[3:] + line, 0.0)
        assert found == [Garbage(line[3:]), sample(-1840.0, 1.0)]


def test_the_rest_of_a_number_of_fixed_width_costs_its_line_and_no_more() -> None:
    profile = cell(stream=ForceReading(frame="{force:8.2f} N", unit="N", rate_hz=10.0))
    host, line = cell_host(profile), cell_device(profile).frame(-1840.0)
    host.forget()
    assert host.receive(line, 0.0) == [sample(-1840.0, 1.0)]
    assert host.receive(line[3:] + line, 0.0) == [Garbage(line[3:]), sample(-1840.0, 1.0)]
