"""What a profile says of an exchange is judged when it is read: each contradiction is refused, and what is none is taken."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from gateway.devices import DeviceProfile, cell_device, cell_host
from gateway.devices.binary.register_access import RegisterAccess, RegisterType
from gateway.devices.binary.rtu_framing import LONGEST_ADU, answers
from gateway.devices.binary.weight_registers import RegisterBit, WeightRegisters
from gateway.devices.device_checks.identity import Identity
from gateway.devices.device_checks.watchdog import WatchdogQuestion, WatchdogState
from gateway.devices.exchange import (
    PressureExchange,
    PressureRange,
    Scale,
    Step,
    VoltageExchange,
    VoltageRange,
)
from gateway.devices.fields import Text, ValueRefused
from gateway.devices.force_reading import ForceReading
from gateway.devices.messages import ForceSample, Quality
from gateway.devices.valve_profile import ValveDirection
from tests.profile_files import load_device

VOLTS = {"device": (0.0, 1023.0), "voltage_v": (0.0, 10.0)}
PASCALS = {"device": (0.0, 1023.0), "pressure_pa": (0.0, 9.0e5)}
READS, WRITES = {"function": 3, "register": 1}, {"function": 6, "register": 1}


def voltage(modbus: dict[str, Any] | None = None, **words: str) -> VoltageExchange:
    return VoltageExchange(modbus=modbus and RegisterAccess(**modbus), range=VoltageRange(**VOLTS), **words)  # type: ignore[arg-type]


def pressure(modbus: dict[str, Any] | None = None, **words: str) -> PressureExchange:
    return PressureExchange(modbus=modbus and RegisterAccess(**modbus), range=PressureRange(**PASCALS), **words)  # type: ignore[arg-type]


def weight(**changes: Any) -> WeightRegisters:
    return WeightRegisters(**{"first": 10, "last": 13, "weight": 11} | changes)


def bit(register: int) -> RegisterBit:
    return RegisterBit(register=register, bit=0)


def valve_words(**words: str) -> object:
    assert VALVE.read_valve
    return replace(VALVE.read_valve, words={word: ValveDirection(means) for word, means in words.items()})


def watchdog_words(**words: str) -> WatchdogQuestion:
    means = {word: WatchdogState(state) for word, state in words.items()}
    return WatchdogQuestion(ask="WDT?", answer="WDT {state:ARMED|TRIP}", words=means)


VALVE = load_device("mcu-valve")
WHO = Identity(ask="ID?", answer="ID {model:s}", models=("A1",))


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (
            lambda: Identity(modbus=RegisterAccess(function=3, register=210), models=("4024",)),
            "a register tells a number: write it without quotes, 4024 or 0x4024",
        ),
        (lambda: replace(load_device("mcu-valve"), identity=WHO), "a valve is never asked what it is"),
        (lambda: replace(load_device("hx711-line"), identity=WHO), "that streams is never asked what it is"),
        (lambda: replace(VALVE, read_valve=None), "a valve needs set_valve and read_valve"),
        (lambda: replace(VALVE, set_valve=None), "a valve needs set_valve and read_valve"),
        (lambda: replace(VALVE, set_voltage=load_device("mcu-line").set_voltage), "belong to other roles"),
        (lambda: replace(VALVE, watchdog=load_device("mcu-line").watchdog), "watchdog belongs to an output"),
        (
            lambda: replace(load_device("mcu-line"), set_voltage=voltage(ask="V {volts:.3f}")),
            "has no answer and there is no",
        ),
        (lambda: valve_words(PUSH="push", PULL="pull", UP="pull"), "words names UP, which .VALVE"),
        (lambda: valve_words(PUSH="push", PULL="push"), "which word means push and which one means pull"),
        (lambda: watchdog_words(ARMED="armed"), "words must name each word of {state:...}, and no other"),
        (lambda: watchdog_words(ARMED="armed", TRIP="tripped", OFF="off"), "must name each word"),
        (lambda: RegisterAccess(function=6, register=0, type="uint32"), "function 6 writes one register"),
        (lambda: voltage(), "`ask` is missing"),
        (lambda: voltage(WRITES, ask="SET {counts:d}"), "leave `ask` and `answer` out"),
        (lambda: pressure(WRITES), "function 6 is none of 3 or 4, which read"),
        (lambda: voltage(ask="SET {n:d}", answer="{n:q}"), "is none of d"),
        (lambda: pressure(ask="REQ"), "`answer` is missing"),
        (lambda: pressure(ask="REQ", answer="{n:q}"), "is none of d"),
        (lambda: VoltageRange(device=(5.0, 5.0), voltage_v=(0.0, 10.0)), "must rise on both sides"),
        (lambda: VoltageRange(device=(0.0, 5.0), voltage_v=(10.0, 0.0)), "must rise on both sides"),
        (lambda: PressureRange(device=(9.0, 5.0), pressure_pa=(0.0, 1.0)), "must rise on both sides"),
        (lambda: PressureRange(device=(0.0, 5.0), pressure_pa=(1.0, 1.0)), "must rise on both sides"),
        (lambda: Step(ask="INC {n:d}", by=1.0), "a step is a bare word"),
        (lambda: ForceReading(), "`frame` is missing"),
        (lambda: ForceReading(frame="{force:+08.2f}", before="#**"), "there is no `ask`"),
        (lambda: ForceReading(frame="{force:d}", unit="N", newton_per_count=0.1), "are two units for one number"),
        (lambda: ForceReading(modbus=weight(), frame="{force:d}"), "leave `ask` and `frame` out"),
        (lambda: ForceReading(modbus=weight(), overload=("S +",)), "are sentences: beside `modbus`"),
        (lambda: weight(last=9), "1 to 32 registers in one request"),
        (lambda: weight(last=42), "1 to 32 registers in one request"),
        (lambda: weight(weight=9), "weight: register 9 is not within"),
        (lambda: weight(weight=13, type="int32"), "weight: register 13 is not within"),
        (lambda: weight(negative=bit(14)), "negative: register 14 is not within"),
        (lambda: weight(unstable=(bit(9),)), "unstable: register 9 is not within"),
        (lambda: weight(overload=(bit(11),)), "is no sign and no state"),
    ],
)
def test_what_contradicts_itself_is_refused(make: Callable[[], object], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        make()


@pytest.mark.parametrize(
    "make",
    [
        lambda: RegisterAccess(function=16, register=0, type="uint32"),
        lambda: RegisterAccess(function=3, register=0, type="float32"),
        lambda: voltage(WRITES, ask="060001{value:uint16}", answer="060001{value:uint16}"),
        lambda: pressure(READS),
        lambda: ForceReading(frame="{force:d}", newton_per_count=0.1),
        lambda: ForceReading(frame="{force:+08.2f}", ask="W?", before="#**"),
        lambda: watchdog_words(ARMED="armed", TRIP="tripped"),
        lambda: weight(first=10, last=41),
        lambda: weight(first=11, last=11),
        lambda: weight(weight=12, type="int32", negative=bit(10), overload=(bit(11),)),
        lambda: weight(weight=10, negative=bit(13)),
    ],
)
def test_what_says_one_thing_is_taken(make: Callable[[], object]) -> None:
    assert make()


def test_registers_stand_for_the_question_and_the_answer() -> None:
    asked = pressure(READS)
    assert (asked.ask, asked.answer) == ("0300010001", "0302{value:uint16}")


@pytest.mark.parametrize("text", ["a\x01", "a ", "\u00e4", ""])
def test_a_text_that_does_not_print_is_not_sent(text: str) -> None:
    with pytest.raises(ValueRefused, match="not printable text"):
        Text("name", 8).encode(text)


def test_a_scale_begins_where_the_device_does() -> None:
    """4 .. 20 mA as 819 .. 4095: the first number is no zero."""
    scale = Scale((819.0, 4095.0), (-1.0, 10.0))
    assert [scale.to_physical(number) for number in (819.0, 4095.0)] == [-1.0, 10.0]
    assert scale.to_physical(scale.to_number(3.3)) == pytest.approx(3.3)


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ({}, False),
        ({"blank_is_overload": True}, True),
        ({"overload": ("S +",)}, True),
        ({"frame": "{status:ST|OL},{force:+08.2f}", "quality": {"ST": Quality.OK, "OL": Quality.OVERLOAD}}, True),
        ({"frame": "", "modbus": weight()}, False),
        ({"frame": "", "modbus": weight(overload=(bit(10),))}, True),
    ],
)
def test_a_device_says_its_overload_in_one_of_four_ways(more: dict[str, Any], says: bool) -> None:
    assert ForceReading(**{"frame": "{force:+08.2f}", "unit": "N"} | more).says_overload is says


def test_a_converter_ends_where_its_digits_do() -> None:
    assert ForceReading(frame="{force:04X}", newton_per_count=0.1).largest_shown == 0xFFFF


def test_a_reading_that_is_only_ever_unstable_has_a_word_for_a_good_one_and_none_for_others() -> None:
    frame, quality = "{status:US|OL},{force:+08.2f}", {"US": Quality.UNSTABLE, "OL": Quality.OVERLOAD}
    reading = ForceReading(frame=frame, unit="N", quality=quality)
    assert [reading.word(one) for one in (Quality.OK, Quality.OVERLOAD, Quality.REPEATED)] == ["US", "OL", None]


def weighing(kind: RegisterType, **more: Any) -> DeviceProfile:
    registers = weight(weight=11, type=kind, decimals=2, **more)
    reading = ForceReading(modbus=registers, unit="N", rate_hz=100)
    return replace(load_device("laumas-tlb"), read_force=reading)


@pytest.mark.parametrize(
    ("kind", "more", "shown", "beyond"),
    [
        ("int16", {}, (327.67, -327.67), (327.69, -327.69)),
        ("uint16", {}, (655.35, 0.0), (655.37, -0.5)),
        ("uint16", {"negative": bit(13)}, (655.35, -655.35), (655.37, -655.37)),
    ],
)
def test_registers_show_what_they_have_room_for_and_the_rest_is_an_overload(
    kind: RegisterType, more: dict[str, Any], shown: tuple[float, ...], beyond: tuple[float, ...]
) -> None:
    profile = weighing(kind, overload=(bit(10),), **more)
    host, device = cell_host(profile), cell_device(profile)
    for force_n in (*shown, *beyond):
        host.poll()
        (sample,) = host.receive(device.frame(force_n), 0.0)
        assert isinstance(sample, ForceSample)
        if force_n in shown:
            assert (sample.force_n, sample.quality) == (pytest.approx(force_n), Quality.OK)
        else:
            assert sample.quality is Quality.OVERLOAD
    with pytest.raises(ValueRefused, match="is more than the amplifier shows"):
        device._tell_registers({"force": beyond[0]}, Quality.OK)  # type: ignore[attr-defined]


def test_noise_without_end_is_told_in_pieces_and_what_waits_is_counted_when_it_is_forgotten() -> None:
    splitter = answers(1)
    told = sum(len(line.data) for _ in range(100) for line in splitter.feed(b"\xff" * 10))
    assert 1000 - LONGEST_ADU - 10 <= told < 1000
    assert splitter.is_between_lines is False
    assert told + splitter.forget() == 1000
    assert splitter.is_between_lines is True


@pytest.mark.parametrize(
    ("device", "decimals", "grid"),
    [((1.1, 9.9), 1, (11, 99)), ((0.14, 4.35), 2, (14, 435)), ((0.05, 9.96), 1, (1, 99)), ((-1.1, 1.1), 1, (-11, 11))],
)
def test_an_end_of_a_range_is_one_of_its_numbers_whatever_binary_fractions_make_of_it(
    device: tuple[float, float], decimals: int, grid: tuple[int, int]
) -> None:
    scale = Scale(device, (0.0, 10.0))
    assert scale.grid(decimals) == grid
    assert scale.on_grid(device[0] - 5.0, decimals) == grid[0] / 10**decimals
    assert scale.on_grid(device[1] + 5.0, decimals) == grid[1] / 10**decimals


def test_the_registers_of_another_output_follow_those_of_the_first() -> None:
    assert RegisterAccess(function=6, register=4).of_channel(2).register == 6
    assert RegisterAccess(function=16, register=4, type="float32").of_channel(2).register == 8


def test_of_two_numbers_in_a_sentence_nobody_knows_which_it_is_about() -> None:
    profile = load_device("smc-itv-rc")
    with pytest.raises(ValueError, match="must carry one number beside constants and words"):
        profile.number_in("SET {a:d} {b:d}")
    named = profile.number_in("SET {a:d} {value:d}")
    assert named is not None and named.name == "value"
