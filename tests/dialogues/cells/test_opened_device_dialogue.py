"""Amplifiers that speak once they are opened on their bus: tecsis EZE30 (BE 948 a, page 22; annex A, page 3), and Flintec's.
`OP 1` is answered `OK` by device 1, then `GG` by the gross value, `SG` by a stream of it."""

from dataclasses import replace

import pytest

from gateway.devices import DeviceProfile, cell_device, cell_host
from gateway.devices.device_checks.identity import Identity
from gateway.devices.force_reading import ForceReading
from gateway.devices.messages import ForceSample, Garbage, Quality
from gateway.devices.rehearsal import rehearse
from gateway.service.probing.harmless_questions import harmless_questions
from gateway.service.running_rig.lines.load_cell_line import CellExchange
from tests.dialogues.cells.test_overload_dialogue import cell

OPENED = {"before": "OP {address:d}", "before_answer": "OK", "frame": "G{force:+07.2f}", "unit": "N"}
ASKED = cell(terminator="\r", constants={"address": 1}, read_force=ForceReading(ask="GG", **OPENED))  # type: ignore[arg-type]
STREAMING = cell(
    terminator="\r", constants={"address": 1}, read_force=None,
    stream=ForceReading(start="SG", rate_hz=100.0, **OPENED),  # type: ignore[arg-type]
)  # fmt: skip
NAMED = replace(ASKED, identity=Identity(ask="ID", answer="{model:s} 1.2", models=("EZE30",)))
READING = ForceSample(123.45, 123.45, Quality.OK, 0.0)


@pytest.mark.parametrize("cut", range(1, 12))
def test_the_acknowledgement_is_no_noise(cut: int) -> None:
    host, answer = cell_host(ASKED), b"OK\rG+123.45\r"
    assert host.poll() == b"OP 1\rGG\r"
    assert [*host.receive(answer[:cut], 0.0), *host.receive(answer[cut:], 0.0)] == [READING]


def test_another_word_in_its_place_is_told() -> None:
    host = cell_host(ASKED)
    host.poll()
    assert host.receive(b"ERR\rG+123.45\r", 0.0) == [Garbage(b"ERR\r"), READING]


def test_a_stream_is_begun_behind_the_opening() -> None:
    host = cell_host(STREAMING)
    assert host.start == b"OP 1\rSG\r"
    assert host.receive(b"OK\rG+123.45\rG+123.45\r", 0.0) == [READING, READING]


@pytest.mark.parametrize("profile", [ASKED, STREAMING])
def test_the_simulated_one_acknowledges_once_it_is_opened(profile: DeviceProfile) -> None:
    host, device = cell_host(profile), cell_device(profile)
    device.receive(host.poll() or host.start, 0.0)
    answered = device.take_answers()
    assert answered == b"OK\r"
    assert device.take_answers() == b""
    assert host.receive(answered + device.frame(-20.0), 0.0) == [ForceSample(-20.0, -20.0, Quality.OK, 0.0)]
    assert list(rehearse(profile)) == []


def test_an_acknowledgement_that_is_a_reading_is_told() -> None:
    reading = replace(ASKED.reading, before_answer="G+000.00")
    told = "'G+000.00' is a reading of 'G{force:+07.2f}', too"
    assert list(rehearse(replace(ASKED, read_force=reading))) == [(("read_force", "before_answer"), told)]


def test_an_acknowledgement_of_nothing_is_refused() -> None:
    with pytest.raises(ValueError, match="`before_answer` answers `before`"):
        replace(ASKED.reading, before="")


@pytest.mark.parametrize(("said", "garbage"), [(b"OK\r", []), (b"ERR\r", [Garbage(b"ERR\r")]), (b"OP 1\rID\rOK\r", [])])
def test_it_is_opened_before_it_is_asked_what_it_is(said: bytes, garbage: list[Garbage]) -> None:
    asked: list[bytes] = []
    exchange = CellExchange(cell_host(NAMED), asked.append, NAMED)
    exchange.tick(1.0)
    assert asked == [b"OP 1\rID\r"]
    assert exchange.receive(said + b"EZE30 1.2\r", 1.0) == garbage
    assert asked[1:] == [b"OP 1\rGG\r"]
    assert [one.data for one in harmless_questions(NAMED)] == asked


def test_the_simulated_one_says_what_it_is_once_it_is_opened() -> None:
    device = cell_device(NAMED)
    assert device.receive(b"OP 1\rID\r", 0.0) == 0
    assert device.take_answers() == b"OK\rEZE30 1.2\r"
