"""Load cells whose sentences end otherwise than in CR LF. Questions that have no end: Sauter's gauges FK and FH, asked by `9`,
scales of Toledo's protocol 8217 by `W`. Answers with a longer one: NCI's protocol SCP-01 of Weigh-Tronix in CR and ETX behind
two lines of text, a transducer interface like Loadstar's DI-100U in a prompt."""

from dataclasses import replace
from typing import Any

import pytest

from gateway.devices import DeviceProfile, cell_device, cell_host
from gateway.devices.device_checks.identity import Identity
from gateway.devices.force_reading import ForceReading
from gateway.devices.messages import ForceSample, Quality
from gateway.devices.rehearsal import rehearse
from gateway.units import NEWTON_PER_UNIT
from tests.dialogues.cells.test_overload_dialogue import cell

SAUTER = replace(
    cell(terminator="\r", read_force=ForceReading(ask="9", frame="{force:8.2f}", unit="N")), question_terminator=""
)
NCI = cell(
    terminator="\r\x03",
    read_force=ForceReading(
        ask="W", frame="\n{force:07.2f}LB\r\nS{status:00|10}", unit="lb",
        quality={"00": Quality.OK, "10": Quality.UNSTABLE}, overload=("\n^^^^^^^LB\r\nS{state:00|02}",),
    ),
)  # fmt: skip
PROMPTING = cell(terminator="\r\n> ", read_force=ForceReading(ask="W", frame="{force:.4f}", unit="lb"))


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


@pytest.mark.parametrize(
    ("profile", "said", "pounds", "quality"),
    [
        (NCI, b"\n0012.34LB\r\nS10\r\x03", 12.34, Quality.UNSTABLE),
        (NCI, b"\n-002.50LB\r\nS00\r\x03", -2.5, Quality.OK),
        (NCI, b"\n^^^^^^^LB\r\nS02\r\x03", float("inf"), Quality.OVERLOAD),
        (PROMPTING, b"-2.5000\r\n> ", -2.5, Quality.OK),
    ],
)
def test_each_answer_is_one_line(profile: DeviceProfile, said: bytes, pounds: float, quality: Quality) -> None:
    host = cell_host(profile)
    host.poll()
    assert list(rehearse(profile)) == []
    for _ in range(2):
        (sample,) = host.receive(said, 0.0)
        assert isinstance(sample, ForceSample) and sample.quality is quality
        assert sample.force_n == pytest.approx(pounds * NEWTON_PER_UNIT["lb"])
