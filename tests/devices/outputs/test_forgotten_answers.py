"""An output that was lost owes no answer, and what is asked of one that has nothing to do."""

from dataclasses import replace

import pytest

from gateway.devices import DeviceRole, cell_host, output_device, output_host
from gateway.devices.force_reading import ForceReading
from gateway.devices.messages import Accepted, ForceSample, Garbage, ReadPressure, ReadVoltage, SetVoltage
from gateway.profiles import list_shipped
from tests.dialogues.cells.test_overload_dialogue import cell
from tests.profile_files import load_device

OUTPUTS = [name for name in list_shipped("device") if load_device(name).role is DeviceRole.OUTPUT]


@pytest.mark.parametrize("name", OUTPUTS)
def test_an_answer_to_what_was_asked_before_a_loss_is_none(name: str) -> None:
    profile = load_device(name)
    host, device = output_host(profile), output_device(profile)
    (asked, *_) = device.receive(host.request(SetVoltage(2.0)), 0.0)
    answer = device.reply(Accepted(2.0), to=asked)
    host.forget()
    assert not any(isinstance(one, Accepted) for one in host.receive(answer, 0.0))


@pytest.mark.parametrize("name", ["smc-itv-rc", "icpdas-702x"])
def test_half_an_answer_of_before_a_loss_is_no_part_of_the_next_line(name: str) -> None:
    host = output_host(load_device(name))
    host.request(SetVoltage(2.0))
    terminator = load_device(name).terminator_bytes
    host.receive(b"half", 0.0)
    host.forget()
    (garbage,) = host.receive(b"whole" + terminator, 0.0)
    assert isinstance(garbage, Garbage) and garbage.data.startswith(b"whole")


@pytest.mark.parametrize("name", OUTPUTS)
def test_an_idle_output_is_asked_for_its_pressure_else_for_its_setting_else_for_nothing(name: str) -> None:
    profile = load_device(name)
    expected = [ReadPressure()] if profile.read_pressure else [ReadVoltage()] if profile.read_voltage else []
    assert output_host(profile).idle_questions == tuple(expected)


@pytest.mark.parametrize("answer", ["", "OK"])
def test_an_idle_output_that_answers_without_a_number_is_asked_for_both(answer: str) -> None:
    """A setting that somebody has changed at its panel shows in the pressure only where that has room to move."""
    profile = load_device("smc-itv-rc")
    assert profile.set_voltage
    profile = replace(profile, set_voltage=replace(profile.set_voltage, answer=answer))
    assert output_host(profile).idle_questions == (ReadPressure(), ReadVoltage())


@pytest.mark.parametrize(("cut", "is_whole"), [(4, False), (0, True)])
def test_the_rest_of_an_answer_that_was_given_up_is_no_reading(cut: int, is_whole: bool) -> None:
    """Of `00184000` a cell that is asked would have read `4000`; where nothing was begun nothing is cut."""
    profile = cell(read_force=ForceReading(ask="W", frame="{force:d}", unit="N"))
    host, line = cell_host(profile), b"184000\r\n"
    host.poll()
    host.receive(line[:cut], 0.0)
    host.forget()
    host.poll()
    found = host.receive(line[cut:], 0.1)
    assert [isinstance(one, ForceSample) for one in found] == [is_whole]
    assert isinstance(host.receive(line, 0.2)[0], ForceSample)
