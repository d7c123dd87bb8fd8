"""What a newcomer gets wrong at a running gateway: an exception for the client, a sentence with a code for the person; of
coefficients that no cylinder has, their line, before anything is sent."""

import math
import struct
from pathlib import Path

import pytest
from click.testing import CliRunner

from gateway.cli.main import command
from tests.end_to_end.conftest import RunningGateway

DEMO = Path(__file__).parents[3] / "profiles" / "calibrations" / "demo.yaml"


def float_words(value: float) -> list[int]:
    return list(struct.unpack(">2H", struct.pack(">f", value)))


SWAPPED = float_words(12.0)[::-1]


@pytest.mark.parametrize(
    ("address", "words", "code", "label", "said"),
    [
        (202, SWAPPED, 3, "W201", ("with the words swapped 12.00 N", "block 300")),
        (302, float_words(12.0), 3, "W201", ("12.00 N", "block 200")),
        (1, [6500], 3, "W204", ("65.00 N", "0 .. 60 N", "rig demo")),
        (202, float_words(65.0), 3, "W204", ("65.00 N", "0 .. 60 N")),
        (202, float_words(math.nan), 3, "W207", ("nan",)),
        (202, float_words(math.inf), 3, "W207", ("inf",)),
        (202, [float_words(12.0)[0]], 3, "W206", ("202 and 203", "one request")),
        (40000, [1], 2, "W202", ("40000",)),
        (40001, [1], 2, "W202", ("40001 is the name of address 0",)),
        (102, [1], 2, "W205", ("read only",)),
        (0, [0x8000], 3, "W2", ()),
    ],
)
def test_a_refusal_is_an_exception_a_register_and_a_sentence(rested, address, words, code, label, said):
    before, earlier = rested.words(0, 13), len(rested.log.read_text().splitlines())
    write = rested.client.write_register if len(words) == 1 else rested.client.write_registers
    refused = write(address, words[0] if len(words) == 1 else words, device_id=1)
    assert refused.isError()
    assert refused.exception_code == code
    assert rested.words(0, 13) == before, "a refused frame leaves no trace"
    assert rested.words(118, 1) == [address]
    sentence = rested.said(label, after=earlier)
    for part in said:
        assert part.lower() in sentence.lower(), sentence
    assert "127.0.0.1" in sentence, "who it was"


def test_a_read_of_40001_is_explained_too(rested):
    refused = rested.client.read_holding_registers(40001, count=2, device_id=1)
    assert refused.exception_code == 2
    assert "40001 is the name of address 0" in rested.said("W202")


def test_a_flood_of_mistakes_is_ten_lines_a_second_and_the_gateway_goes_on(rested):
    before = rested.log.read_text().count("W204")
    for _ in range(300):
        rested.write(1, 6500)
    lines = rested.log.read_text().count("W204") - before
    assert 1 <= lines <= 40
    assert not rested.write(0, 1, 900).isError()
    rested.wait_until(lambda status: abs(status["force_measured"] - 900) <= 100)


def uploaded(gateway: RunningGateway, file: Path) -> tuple[int, str]:
    done = CliRunner().invoke(command, ["upload", str(file), "--gateway", f"127.0.0.1:{gateway.port}"])
    return done.exit_code, done.output


def test_refused_coefficients_are_named_and_the_active_set_stays(rested: RunningGateway, tmp_path: Path) -> None:
    before = rested.words(1500, 60)
    text = DEMO.read_text()
    assert "65.2319041283]" in text
    (tmp_path / "falls.yaml").write_text(text.replace("65.2319041283]", "-5.0]", 1))
    code, said = uploaded(rested, tmp_path / "falls.yaml")
    assert code == 65
    assert "falls.yaml:9:20 rising_handles_n[0]: the rising branch is not increasing" in said
    assert rested.words(1500, 60) == before
    assert math.isclose(rested.force_n(), 0.0, abs_tol=2.0)
