"""Overloads as makers print them: Mettler Toledo's MT-SICS reference (SI, SIR) and A&D's manuals of the GX series."""

from math import inf

import pytest

from gateway.devices import DeviceProfile, cell_device, cell_host
from gateway.devices.force_reading import ForceReading
from gateway.devices.line_settings import SerialSettings
from gateway.devices.messages import ForceSample, Garbage, Quality
from gateway.devices.profile import Certainty, DeviceRole, Terminator

GRAM_N = 0.00980665


def cell(*, terminator: Terminator = "\r\n", **reading: ForceReading) -> DeviceProfile:
    return DeviceProfile(
        name="own",
        description="a load cell",
        role=DeviceRole.LOAD_CELL,
        source="the maker's manual",
        certainty=Certainty.MANUAL,
        hardware="never run on hardware",
        serial=SerialSettings(baud=38400, data_bits=8, parity="none", stop_bits=1),
        terminator=terminator,
        **reading,  # type: ignore[arg-type]
    )


def sics(**how: object) -> ForceReading:
    return ForceReading(
        frame="S {status:S|D} {force:10.2f} {unit:g|kg}",
        unit="g",
        quality={"S": Quality.OK, "D": Quality.UNSTABLE},
        overload=("S +",),
        underload=("S -",),
        **how,  # type: ignore[arg-type]
    )


POLLED = cell(read_force=sics(ask="SI", rate_hz=20.0))
STREAM = cell(stream=sics(rate_hz=90.0))
AND = cell(
    stream=ForceReading(
        frame="{status:ST|US},{force:+09.2f}  g",
        unit="g",
        quality={"ST": Quality.OK, "US": Quality.UNSTABLE},
        overload=("OL,+9999999E+19",),
        underload=("OL,-9999999E+19",),
        rate_hz=10.0,
    )
)
OVER, UNDER = ForceSample(inf, inf, Quality.OVERLOAD, 7.0), ForceSample(-inf, -inf, Quality.OVERLOAD, 7.0)


@pytest.mark.parametrize("profile", [POLLED, STREAM], ids=["asked", "stream"])
@pytest.mark.parametrize(
    ("line", "found"),
    [
        (b"S S     100.00 g\r\n", ForceSample(100.0, pytest.approx(100 * GRAM_N), Quality.OK, 7.0)),
        (b"S D     129.07 g\r\n", ForceSample(129.07, pytest.approx(129.07 * GRAM_N), Quality.UNSTABLE, 7.0)),
        (b"S +\r\n", OVER),
        (b"S -\r\n", UNDER),
        (b"S I\r\n", Garbage(b"S I\r\n")),  # the command cannot be executed at present
        (b"S +    1.00 g\r\n", Garbage(b"S +    1.00 g\r\n")),
        (b"S + \r\n", Garbage(b"S + \r\n")),
    ],
)
def test_sics_answers_an_overload_without_a_number(profile: DeviceProfile, line: bytes, found: object) -> None:
    assert cell_host(profile).receive(line, 7.0) == [found]


@pytest.mark.parametrize(
    ("line", "found"),
    [
        (b"ST,+00012.78  g\r\n", ForceSample(12.78, pytest.approx(12.78 * GRAM_N), Quality.OK, 7.0)),
        (b"OL,+9999999E+19\r\n", OVER),
        (b"OL,-9999999E+19\r\n", UNDER),
        (b"OL,+9999999E+18\r\n", Garbage(b"OL,+9999999E+18\r\n")),
    ],
)
def test_the_standard_format_of_a_and_d_says_overload_with_an_exponent(line: bytes, found: object) -> None:
    assert cell_host(AND).receive(line, 7.0) == [found]


@pytest.mark.parametrize(
    ("profile", "force_n", "line"),
    [
        (POLLED, 1e3, b"S +\r\n"),
        (POLLED, -1e3, b"S -\r\n"),
        (STREAM, 1e3, b"S +\r\n"),
        (AND, 1e3, b"OL,+9999999E+19\r\n"),
        (AND, -1e3, b"OL,-9999999E+19\r\n"),
    ],
)
def test_the_simulated_device_says_it_as_printed(profile: DeviceProfile, force_n: float, line: bytes) -> None:
    assert cell_device(profile).frame(force_n, Quality.OVERLOAD) == line
