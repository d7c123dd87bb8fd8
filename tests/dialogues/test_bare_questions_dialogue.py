"""Load cells that are asked by a bare character: Sauter's gauges FK and FH by `9`, scales of Toledo's protocol 8217 by `W`."""

from dataclasses import replace
from typing import Any

import pytest

from gateway.devices import cell_device, cell_host
from gateway.devices.device_checks.identity import Identity
from gateway.devices.force_reading import ForceReading
from gateway.devices.messages import ForceSample, Quality
from gateway.devices.rehearsal import rehearse
from tests.dialogues.test_overload_dialogue import cell

SAUTER = replace(
    cell(terminator="\r", read_force=ForceReading(ask="9", frame="{force:8.2f}", unit="N")), question_terminator=""
)


def test_a_question_without_an_end_goes_out_bare() -> None:
    host, device = cell_host(SAUTER), cell_device(SAUTER)
    assert list(rehearse(SAUTER)) == []
    assert host.poll() == b"9" and device.receive(b"99", 0.0) == 2


def test_it_costs_no_answer_its_first_digit() -> None:
    host = cell_host(SAUTER)
    host.poll()
    assert host.receive(b"90000.25\r", 0.0) == [ForceSample(90000.25, 90000.25, Quality.OK, 0.0)]


def test_a_number_that_an_echo_would_lengthen_needs_a_width() -> None:
    (found,) = rehearse(replace(SAUTER, read_force=replace(SAUTER.reading, frame="{force:.2f}")))
    assert found[0] == ("read_force", "frame") and "'90.00\\r', through an adapter that hears itself" in found[1]
    assert not list(rehearse(replace(SAUTER, read_force=replace(SAUTER.reading, ask="W", frame="{force:.2f}"))))


@pytest.mark.parametrize(
    "beside",
    [
        {"read_force": replace(SAUTER.reading, before="#")},
        {"read_force": None, "stream": ForceReading(frame="{force:.2f}", unit="N", rate_hz=10.0)},
        {"identity": Identity(ask="V", answer="{model:s}", models=("FK",))},
    ],
)
def test_it_is_the_only_sentence_of_its_device(beside: dict[str, Any]) -> None:
    (found,) = rehearse(replace(SAUTER, **beside))
    assert found[0] == ("question_terminator",) and "one sentence" in found[1]
