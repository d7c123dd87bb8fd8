"""Frames of the Laumas TLB: weight, sign and health in one answer (register table of its protocol manual)."""

from math import nan

import pytest

from gateway.devices import DeviceProfile, cell_device, cell_host
from gateway.devices.messages import ForceSample, Garbage, Quality
from gateway.modbus.crc import crc_bytes
from tests.profile_files import load_device

KG_N = 9.80665


@pytest.fixture(scope="module")
def profile() -> DeviceProfile:
    return load_device("laumas-tlb")


def answer(*registers: int) -> bytes:
    body = bytes((1, 3, 2 * len(registers))) + b"".join(word.to_bytes(2, "big") for word in registers)
    return body + crc_bytes(body)


def test_one_request_asks_for_all_that_a_weight_is_made_of(profile: DeviceProfile) -> None:
    assert cell_host(profile).poll() == bytes.fromhex("0103000600 0565C8")


@pytest.mark.parametrize(
    ("status", "weight", "raw", "quality"),
    [
        (0x0000, 1234, 12.34, Quality.OK),
        (0x0080, 1234, -12.34, Quality.OK),  # the sign is bit 7 of the status
        (0x0100, 1234, 12.34, Quality.OK),  # bit 8 is the net weight's sign
        (0x0800, 0x00010002, 655.38, Quality.OK),  # stable; the high word comes first
        (0x0001, 1234, 12.34, Quality.OVERLOAD),  # load cell error
        (0x0002, 1234, 12.34, Quality.OVERLOAD),  # converter
        (0x0004, 999999, 9999.99, Quality.OVERLOAD),  # over the maximum
        (0x0010, 999999, 9999.99, Quality.OVERLOAD),  # beyond what it can tell
        (0x0088, 999999, -9999.99, Quality.OVERLOAD),  # over 110 %
    ],
)
def test_sign_and_health_come_from_the_status(
    profile: DeviceProfile, status: int, weight: int, raw: float, quality: Quality
) -> None:
    frame = answer(status, weight >> 16, weight & 0xFFFF, 0, 5)
    assert cell_host(profile).receive(frame, 2.0) == [
        ForceSample(pytest.approx(raw), pytest.approx(raw * KG_N), quality, 2.0)
    ]


def test_a_sign_alone_and_a_weight_alone_are_no_reading(profile: DeviceProfile) -> None:
    """Answers to two requests, as a reader sends who asks for status and weight one after the other."""
    for torn in (answer(0x0080), answer(0, 1234), answer(0x0080, 0, 1234, 0, 5)[:-1] + b"\0"):
        assert all(isinstance(one, Garbage) for one in cell_host(profile).receive(torn, 0.0)), torn.hex()


def test_the_simulated_transmitter_answers_so(profile: DeviceProfile) -> None:
    device = cell_device(profile)
    assert device.receive(bytes.fromhex("01030006000565C8"), 0.0) == 1
    assert device.receive(bytes.fromhex("01030006000465C8"), 0.0) == 0
    assert device.frame(-12.34 * KG_N) == answer(0x0080, 0, 1234, 0, 0)
    assert device.frame(12.34 * KG_N, Quality.OVERLOAD) == answer(0x0001, 0x000F, 0x423F, 0, 0)
    assert cell_host(profile).receive(device.frame(nan), 0.0)[0].quality is Quality.OVERLOAD  # type: ignore[union-attr]
