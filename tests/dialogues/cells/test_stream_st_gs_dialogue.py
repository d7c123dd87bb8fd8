"""Lines as the manuals of three makers print them (see `source` of profiles/devices/stream-st-gs.yaml)."""

from math import isnan

import pytest

from gateway.devices import DeviceProfile, cell_device, cell_host
from gateway.devices.messages import ForceSample, Garbage, Quality


def only(profile: DeviceProfile, data: bytes) -> ForceSample | Garbage:
    (found,) = cell_host(profile).receive(data, 7.0)
    return found


@pytest.mark.parametrize(
    ("line", "raw", "force_n", "quality"),
    [
        (b"ST,GS,+0012.34kg\r\n", 12.34, 121.014061, Quality.OK),
        (b"US,GS,-0000.20kg\r\n", -0.2, -1.96133, Quality.UNSTABLE),
        (b"ST,NT,+0001.00kg\r\n", 1.0, 9.80665, Quality.OK),
        (b"ST,GS,+   1.00lb\r\n", 1.0, 4.4482216152605, Quality.OK),
        (b"ST,GS,   18.00kg\r\n", 18.0, 176.5197, Quality.OK),
        (b"US,NT,-   0.20kg\r\n", -0.2, -1.96133, Quality.UNSTABLE),
        (b"ST,GS,   -0.20kg\r\n", -0.2, -1.96133, Quality.OK),
        (b"ST,GS,+0500.00g\r\n", 500.0, 4.903325, Quality.OK),
        (b"ST,GS,+0012.34N\r\n", 12.34, 12.34, Quality.OK),
        (b"OL,GS,+0099.99kg\r\n", 99.99, 980.5669335, Quality.OVERLOAD),
    ],
)
def test_a_line_is_read_as_printed(
    indicator: DeviceProfile, line: bytes, raw: float, force_n: float, quality: Quality
) -> None:
    assert only(indicator, line) == ForceSample(raw, pytest.approx(force_n, rel=1e-12), quality, 7.0)


@pytest.mark.parametrize("line", [b"OL,GS,        kg\r\n", b"OL,GS,+       kg\r\n", b"ST,GS,        kg\r\n"])
def test_blanks_instead_of_digits_are_an_overload(indicator: DeviceProfile, line: bytes) -> None:
    sample = only(indicator, line)
    assert isinstance(sample, ForceSample)
    assert isnan(sample.raw)
    assert isnan(sample.force_n)
    assert sample.quality is Quality.OVERLOAD


@pytest.mark.parametrize(
    "line",
    [
        b"ST,GS,+0001234kg\r\n",  # missing decimal point
        b"ST,GS,+012.345kg\r\n",  # another display
        b"ST,GS,+00 2.34kg\r\n",  # a digit lost to noise
        b"ST,GS,++012.34kg\r\n",
        b"ST,GS,+0012.34\r\n",  # no unit
        b"ST,GS,+0012.34oz\r\n",
        b"XX,GS,+0012.34kg\r\n",
        b"T,GS,+0012.34kg\r\n",
        b"ST,GS,+0012.34kg \r\n",
        b"ST,GS,+0012.\xb34kg\r\n",
        b"\r\n",
    ],
)
def test_anything_else_is_garbage_and_counted_whole(indicator: DeviceProfile, line: bytes) -> None:
    assert only(indicator, line) == Garbage(line)


def test_kilograms_are_not_newtons(indicator: DeviceProfile) -> None:
    sample = only(indicator, b"ST,GS,+0010.00kg\r\n")
    assert isinstance(sample, ForceSample)
    assert sample.force_n == pytest.approx(98.0665)


@pytest.mark.parametrize(
    ("force_n", "quality", "line"),
    [
        (121.014061, Quality.OK, b"ST,GS,+0012.34kg\r\n"),
        (-1.96133, Quality.UNSTABLE, b"US,GS,-0000.20kg\r\n"),
        (-0.001, Quality.OK, b"ST,GS,+0000.00kg\r\n"),
        (50.0, Quality.OVERLOAD, b"OL,GS,        kg\r\n"),
        (1.0e6, Quality.OK, b"OL,GS,        kg\r\n"),
        (float("nan"), Quality.OK, b"OL,GS,        kg\r\n"),
    ],
)
def test_the_simulated_indicator_prints_so(
    indicator: DeviceProfile, force_n: float, quality: Quality, line: bytes
) -> None:
    assert cell_device(indicator).frame(force_n, quality) == line
