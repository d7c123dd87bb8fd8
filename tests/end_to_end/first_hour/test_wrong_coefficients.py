"""Coefficients that no cylinder has, uploaded: told at their line before anything is sent; the set in use stays."""

import math
from pathlib import Path

from click.testing import CliRunner

from gateway.cli.main import command
from tests.end_to_end.conftest import RunningGateway

DEMO = Path(__file__).parents[3] / "profiles" / "calibrations" / "demo.yaml"


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
