"""Lines that a device says besides, of another sensor or of its program: a profile names them, and they are no noise."""

from dataclasses import replace
from typing import Any

import pytest

from gateway.devices import DeviceProfile, TemplateError, cell_host, output_host
from gateway.devices.checksum import add_checksum
from gateway.devices.exchange import VoltageExchange, VoltageRange
from gateway.devices.force_reading import ForceReading
from gateway.devices.messages import Accepted, ForceSample, Garbage, Quality, ReadVoltage, SetVoltage
from gateway.devices.rehearsal import rehearse
from gateway.profiles import load_device
from tests.dialogues.cells.test_overload_dialogue import cell
from tests.dialogues.outputs.test_unshipped_outputs_dialogue import device

BESIDE = ("T {tare:8.2f} kg", "T={degrees:.1f}", "HX711 {word:ready|busy}")
BLOCK = replace(  # an indicator that says gross, tare and net, each in a line
    cell(stream=ForceReading(frame="N {force:8.2f} kg", unit="kg", overload=("N ------ kg",), rate_hz=10.0)),
    read_over=("G {gross:8.2f} kg", *BESIDE),
)
FORCE = ForceSample(12.5, pytest.approx(12.5 * 9.80665), Quality.OK, 0.0)
VOLTS = VoltageRange(device=(0.0, 10.0), voltage_v=(0.0, 10.0))
DAC = device(
    set_voltage=VoltageExchange(ask="V{volts:.2f}", answer="OK {volts:.2f}", range=VOLTS),
    read_voltage=VoltageExchange(ask="V?", answer="V {volts:.2f}", range=VOLTS),
    read_over=("alive {seconds:d}", "setting.."),
)


@pytest.mark.parametrize(
    ("said", "found"),
    [
        (b"G    12.50 kg\r\nT     0.00 kg\r\nN    12.50 kg\r\n", [FORCE]),
        (b"HX711 ready\r\nT=23.5\r\nN    12.50 kg\r\nT=23.6\r\n", [FORCE]),
        (b"T=23.x\r\nN    12.50 kg\r\n", [Garbage(b"T=23.x\r\n"), FORCE]),
        (b"HX711 ready!\r\n", [Garbage(b"HX711 ready!\r\n")]),
        (b"N    12x50 kg\r\n", [Garbage(b"N    12x50 kg\r\n")]),
    ],
)
def test_a_load_cell_s_other_lines_are_no_noise(said: bytes, found: list[object]) -> None:
    for size in (1, len(said)):
        host = cell_host(BLOCK)
        pieces = [said[at : at + size] for at in range(0, len(said), size)]
        assert [one for piece in pieces for one in host.receive(piece, 0.0)] == found


def test_they_have_the_checksum_that_all_lines_of_the_device_have() -> None:
    host = cell_host(replace(BLOCK, checksum="xor"))
    good, bad = add_checksum(b"T=23.5", "xor") + b"\r\n", b"T=23.5*00\r\n"
    assert host.receive(good + bad, 0.0) == [Garbage(bad)]


def test_a_line_with_nothing_in_it_is_an_empty_sentence() -> None:
    """Between two blocks of lines, or where each line ends twice."""
    said = b"N    12.50 kg\r\n\r\n\r\n"
    assert cell_host(BLOCK).receive(said, 0.0) == [FORCE, Garbage(b"\r\n"), Garbage(b"\r\n")]
    profile = replace(BLOCK, read_over=("", *BESIDE))
    assert cell_host(profile).receive(said, 0.0) == [FORCE]
    assert list(rehearse(profile)) == []


def test_an_output_s_other_lines_are_no_noise_and_leave_the_order_of_its_answers_alone() -> None:
    host = output_host(DAC)
    host.request(SetVoltage(5.0))
    host.request(ReadVoltage())
    said = b"alive 17\nsetting..\nOK 5.00\nalive 18\nV 5.00\n"
    assert host.receive(said, 0.0) == [Accepted(5.0), Accepted(5.0)]
    host.request(ReadVoltage())
    assert host.receive(b"alive x\nV 5.00\n", 0.0) == [Garbage(b"alive x\n"), Accepted(5.0)]


@pytest.mark.parametrize(
    ("profile", "text"),
    [
        (BLOCK, "{anything:s}"),
        (BLOCK, "N {word:s}"),
        (BLOCK, "N {word:------|OVER} kg"),
        (DAC, "OK{anything:s}"),
        (DAC, "V {volts:.2f}"),
    ],
)
def test_a_sentence_that_is_an_answer_too_would_hide_noise(profile: DeviceProfile, text: str) -> None:
    (told,) = rehearse(replace(profile, read_over=("B", text)))
    assert told[0] == ("read_over", 1)
    assert "is read over, too" in told[1]


@pytest.mark.parametrize(
    ("name", "changes", "told"),
    [
        ("laumas-tlb", {}, "leave terminator, checksum and read_over out"),
        ("mcu-valve", {}, "read_over belongs to an output or a load cell"),
        ("stream-st-gs", {"read_over": ("{x:q}",)}, "is none of d"),
    ],
)
def test_it_is_of_lines(name: str, changes: dict[str, Any], told: str) -> None:
    with pytest.raises((ValueError, TemplateError), match=told):
        replace(load_device(name), **({"read_over": ("alive",)} | changes))


def test_what_both_ends_say_is_understood() -> None:
    assert [*rehearse(BLOCK), *rehearse(DAC)] == []
