"""Amplifiers that speak in registers or raw bytes: what a status bit means, what is noise, where a value ends."""

from dataclasses import replace
from math import inf

import pytest

from gateway.devices import DeviceProfile, cell_device, cell_host
from gateway.devices.binary.register_access import RegisterType, WordOrder
from gateway.devices.binary.rtu_framing import rtu_frame
from gateway.devices.binary.weight_registers import RegisterBit, WeightRegisters
from gateway.devices.force_reading import ForceReading
from gateway.devices.messages import ForceSample, Garbage, Quality
from tests.profile_files import load_device


@pytest.fixture(scope="module")
def moving() -> DeviceProfile:
    """An amplifier whose status says in bits 9 and 12 that the weight is in motion."""
    profile = load_device("laumas-tlb")
    registers = profile.reading.modbus
    assert registers
    unstable = (RegisterBit(register=6, bit=9), RegisterBit(register=6, bit=12))
    assert profile.read_force
    return replace(profile, read_force=replace(profile.read_force, modbus=replace(registers, unstable=unstable)))


@pytest.mark.parametrize("quality", [Quality.OK, Quality.UNSTABLE, Quality.OVERLOAD])
def test_what_an_amplifier_says_of_its_weight_is_heard(moving: DeviceProfile, quality: Quality) -> None:
    host, device = cell_host(moving), cell_device(moving)
    host.poll()
    (sample,) = host.receive(device.frame(-12.0, quality), 1.5)
    assert isinstance(sample, ForceSample)
    assert (sample.quality, sample.time_s) == (quality, 1.5)
    if quality is not Quality.OVERLOAD:
        assert sample.force_n == pytest.approx(-12.0, abs=host.resolution_n)


@pytest.mark.parametrize(
    ("status", "quality"),
    [("0002", Quality.OK), ("0006", Quality.UNSTABLE), ("0000", Quality.OVERLOAD), ("0004", Quality.OVERLOAD)],
)
def test_a_bit_that_stands_while_all_is_well_means_an_overload_when_it_is_gone(status: str, quality: Quality) -> None:
    """Status of Flintec's FT-16, page 27: D1 is 1 where the data are right, D2 where the weight is not stable."""
    registers = WeightRegisters(
        first=2,
        last=6,
        weight=5,
        type="int32",
        decimals=2,
        overload=(RegisterBit(register=2, bit=1, value=0),),
        unstable=(RegisterBit(register=2, bit=2),),
    )
    profile = replace(load_device("laumas-tlb"), read_force=ForceReading(modbus=registers, unit="kg", rate_hz=100))
    host, device = cell_host(profile), cell_device(profile)
    host.poll()
    (sample,) = host.receive(rtu_frame(1, f"030A{status}0000000000000064".encode()), 0.0)
    assert sample == ForceSample(1.0, pytest.approx(9.80665), quality, 0.0)
    host.poll()
    (simulated,) = host.receive(device.frame(-12.0, quality), 0.0)
    assert isinstance(simulated, ForceSample)
    assert simulated.quality is quality


@pytest.mark.parametrize("order", ["abcd", "cdab"])
def test_a_float_weight_is_not_rounded_to_whole_units(order: WordOrder) -> None:
    """A float32 in kg with the point of its own: 1.25 kg, and a step of 1 mN or so, not of 9.81 N."""
    profile = load_device("laumas-tlb")
    registers = WeightRegisters(first=63, last=66, weight=63, type="float32", word_order=order)
    reading = ForceReading(modbus=registers, unit="kg", rate_hz=100)
    profile = replace(profile, read_force=reading)
    host, device = cell_host(profile), cell_device(profile)
    host.poll()
    data = "3fa00000" if order == "abcd" else "00003fa0"
    (sample,) = host.receive(rtu_frame(1, f"0308{data}00000000".upper().encode()), 0.0)
    assert isinstance(sample, ForceSample)
    assert sample.force_n == pytest.approx(1.25 * 9.80665)
    assert host.resolution_n < 0.01
    host.poll()
    (sample,) = host.receive(device.frame(12.3), 1.0)
    assert isinstance(sample, ForceSample)
    assert sample.force_n == pytest.approx(12.3, abs=0.01)
    with pytest.raises(ValueError, match="a float32 has its own point"):
        replace(registers, decimals=2)


def test_noise_between_values_is_counted_byte_for_byte() -> None:
    profile = load_device("hbm-aed-binary")
    unit = None if profile.reading.newton_per_unit else "N"
    host, device = cell_host(profile, unit=unit), cell_device(profile, unit)
    frame = device.frame(12.0)
    heard = host.receive(frame + b"\x01\x02\x03" + frame, 0.0)
    assert [type(one) for one in heard] == [ForceSample, Garbage, ForceSample]
    assert [one.data for one in heard if isinstance(one, Garbage)] == [b"\x01\x02\x03"]
    size = len(frame)
    (alone,) = host.receive(b"\x07" * (size + 2), 0.0)
    assert alone == Garbage(b"\x07" * 3), "the rest may be the beginning of a value"
    host.forget()
    assert [type(one) for one in host.receive(frame, 0.0)] == [ForceSample]


@pytest.mark.parametrize("bytes_at_a_time", [1, 3, 6, 10])
def test_an_answer_in_digits_is_no_binary_value(bytes_at_a_time: int) -> None:
    """An AED that has lost its setting answers as COF3: of each answer `2345` was a reading of 3289908, and so of any other."""
    host = cell_host(load_device("hbm-aed-binary"), unit="N")
    for text in (b"+0012345\r\n", b"-0000042\r\n", b"Total=+0000.51 kg\r\n"):
        host.poll()
        pieces = [text[k : k + bytes_at_a_time] for k in range(0, len(text), bytes_at_a_time)]
        heard = [one for piece in pieces for one in host.receive(piece, 0.0)]
        assert {type(one) for one in heard} == {Garbage}
        assert b"".join(one.data for one in heard if isinstance(one, Garbage)) == text
    host.poll()
    (sample,) = host.receive(cell_device(load_device("hbm-aed-binary"), "N").frame(12.0), 0.0)
    assert isinstance(sample, ForceSample) and sample.raw == 12.0


def test_a_value_beyond_the_range_stands_at_its_end() -> None:
    profile = load_device("hbm-aed-binary")
    unit = None if profile.reading.newton_per_unit else "N"
    host, device = cell_host(profile, unit=unit), cell_device(profile, unit)
    told = (
        (1e12, Quality.OK),
        (-1e12, Quality.OK),
        (50.0, Quality.OVERLOAD),
        (-50.0, Quality.OVERLOAD),
        (-inf, Quality.OK),
    )
    for force_n, quality in told:
        (sample,) = host.receive(device.frame(force_n, quality), 0.0)
        assert isinstance(sample, ForceSample)
        assert abs(sample.raw) >= profile.reading.largest_shown
        assert (sample.raw > 0) == (force_n > 0)


def test_a_zero_that_is_none_and_the_lower_byte_first_are_those_of_both_ends() -> None:
    profile = load_device("hbm-aed-binary")
    assert profile.read_force
    usual = cell_device(profile, "N").frame(12.0)
    for changes in ({"zero_count": 5000.0}, {"frame": "{force:int32-cdab}"}):
        other = replace(profile, read_force=replace(profile.read_force, **changes))  # type: ignore[arg-type]
        for unit in ("kg", "N"):
            host, device = cell_host(other, unit=unit), cell_device(other, unit)
            (sample,) = host.receive(device.frame(12.0), 0.0)
            assert isinstance(sample, ForceSample)
            assert sample.force_n == pytest.approx(12.0, abs=host.resolution_n)
        assert device.frame(12.0) != usual
    assert device.frame(12.0)[:4] == usual[3::-1]


def test_the_zero_of_raw_counts_is_the_converters_whichever_way_the_cell_is_wired() -> None:
    """Turned with the sign, a cell that hangs the other way round was off by twice its zero."""
    profile = load_device("hbm-aed-binary")
    assert profile.read_force
    other = replace(profile, read_force=replace(profile.read_force, zero_count=5000.0))
    frame = cell_device(other, "N").frame(12.0)
    readings = [cell_host(other, sign, "N").receive(frame, 0.0)[0] for sign in (1, -1)]
    forces = [one.force_n for one in readings if isinstance(one, ForceSample)]
    assert forces == [pytest.approx(12.0, abs=0.1), pytest.approx(-12.0, abs=0.1)]


def at_its_end(kind: RegisterType, end_count: float, decimals: int = 0) -> DeviceProfile:
    """An amplifier that says nothing of an overload but stands at its converter's end."""
    registers = WeightRegisters(function=4, first=0, last=1, weight=0, type=kind, decimals=decimals)
    reading = ForceReading(modbus=registers, newton_per_count=0.01, end_count=end_count)
    return replace(load_device("laumas-tlb"), read_force=reading)


@pytest.mark.parametrize(
    ("profile", "registers", "quality"),
    [
        (at_its_end("int16", 32767), "7FFF0000", Quality.OVERLOAD),
        (at_its_end("int16", 32767), "80000000", Quality.OVERLOAD),
        (at_its_end("int16", 32767), "7FFE0000", Quality.OK),
        (at_its_end("int16", 32767, decimals=2), "7FFF0000", Quality.OVERLOAD),  # the count, not the 327.67 that it is
        (at_its_end("int32", 0x7FFFFFFF), "7FFFFFFF", Quality.OVERLOAD),
    ],
)
def test_a_register_at_its_converters_end_is_an_overload(
    profile: DeviceProfile, registers: str, quality: Quality
) -> None:
    (sample,) = cell_host(profile).receive(rtu_frame(1, f"0404{registers}".encode()), 0.0)
    assert isinstance(sample, ForceSample) and sample.quality is quality
    (shown,) = cell_host(profile).receive(cell_device(profile).frame(inf), 0.0)
    assert isinstance(shown, ForceSample) and shown.quality is Quality.OVERLOAD


def test_an_amplifier_that_says_no_unit_is_rehearsed_in_that_of_the_rig() -> None:
    registers = WeightRegisters(first=0, last=1, weight=0, type="int32", decimals=2)
    profile = replace(load_device("laumas-tlb"), read_force=ForceReading(modbus=registers))
    in_kg, in_n = cell_device(profile, "kg").frame(9.80665), cell_device(profile, "N").frame(9.80665)
    (sample,) = cell_host(profile, unit="kg").receive(in_kg, 0.0)
    assert isinstance(sample, ForceSample) and (sample.raw, sample.force_n) == (1.0, pytest.approx(9.80665))
    assert in_n != in_kg


def test_an_amplifier_in_motion_at_its_converters_end_is_overloaded() -> None:
    registers = WeightRegisters(function=4, first=0, last=1, weight=0, unstable=(RegisterBit(register=1, bit=0),))
    reading = ForceReading(modbus=registers, newton_per_count=0.01, end_count=32767)
    host = cell_host(replace(load_device("laumas-tlb"), read_force=reading))
    samples = [
        one for words in ("7FFF0001", "7FFE0001") for one in host.receive(rtu_frame(1, f"0404{words}".encode()), 0.0)
    ]
    assert [getattr(one, "quality", None) for one in samples] == [Quality.OVERLOAD, Quality.UNSTABLE]


@pytest.mark.parametrize("registers", ["FFFFFB2E0080", "000004D20080"])
def test_a_sign_that_is_told_twice_is_one_minus(registers: str) -> None:
    """A weight of a signed type whose state register says its sign, too: a pull was read as a push."""
    registers_read = WeightRegisters(
        first=0, last=2, weight=0, type="int32", decimals=2, negative=RegisterBit(register=2, bit=7)
    )
    profile = replace(load_device("laumas-tlb"), read_force=ForceReading(modbus=registers_read, unit="N"))
    (sample,) = cell_host(profile).receive(rtu_frame(1, f"0306{registers}".encode()), 0.0)
    assert isinstance(sample, ForceSample) and sample.force_n == pytest.approx(-12.34)
    (pushed,) = cell_host(profile).receive(rtu_frame(1, b"0306000004D20000"), 0.0)
    assert isinstance(pushed, ForceSample) and pushed.force_n == pytest.approx(12.34)
