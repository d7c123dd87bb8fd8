"""A probe of silent ports takes long, and says meanwhile what it asks, and how much of that is done."""

import json
import os
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from click.testing import CliRunner

from gateway.cli.main import command
from gateway.cli.setup import port_probing
from gateway.cli.setup.port_probing import probe_path
from gateway.processes import exit_codes
from gateway.profiles import load_device
from gateway.progress import Progress, listen
from gateway.service.probing import port_probe
from tests.service.probing.test_port_probe import RIG


@contextmanager
def silent_port() -> Iterator[str]:
    """Yield the path of a serial port whose device says nothing."""
    device, port = os.openpty()
    tty.setraw(port)
    try:
        yield os.ttyname(port)
    finally:
        os.close(device)
        os.close(port)


def test_a_probe_tells_which_port_it_asks_and_at_how_many_speeds_it_has() -> None:
    told: list[Progress] = []
    with silent_port() as path, listen(told.append):
        report = probe_path(path, [load_device("stream-st-gs"), load_device("icpdas-702x")], is_speed_known=True)
    assert not report.answers
    assert told == [Progress(f"speeds of {path}", done, 2) for done in (0, 1)]


def test_check_says_on_stderr_how_far_its_probe_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of two silent ports nothing was said for 40 s: it looked as if it hung."""
    monkeypatch.setattr(port_probe, "BAUDS", (9600,))
    monkeypatch.setattr(port_probing, "known_profiles", lambda role: [])
    rig = tmp_path / "own.yaml"
    with silent_port() as output, silent_port() as cell:
        rig.write_text(RIG.format(device="icpdas-702x", output=output, cell=cell, baud=9600))
        result = CliRunner().invoke(command, ["check", str(rig), "--probe", "--json"])
    assert result.exit_code == exit_codes.DEVICE, result.output
    assert "probing, 1 s" in result.stderr and f"speeds of {cell}" in result.stderr
    assert json.loads(result.stdout)["probe"].keys() == {"output", "load_cell"}
