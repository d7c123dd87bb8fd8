"""A rig that is rehearsed at a desk with `run --sim` before its ports are written: all that opens no port works with it."""

from __future__ import annotations

import tarfile
from pathlib import Path
from typing import Any

import pytest

from gateway.cli.options import StateChoice
from gateway.cli.plants.store_access import load_rig_or_none
from gateway.profiles import ProfileError, load_rig, read_rig
from gateway.service.fitting.ladder_source import find_rig


@pytest.fixture(autouse=True)
def cell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: Any) -> Path:
    """The file that `init` writes, its ports still placeholders."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "state").mkdir()
    assert call("init", "cell").exit_code == 0
    return tmp_path / "cell.yaml"


def test_it_is_read_as_it_stands_and_starts_on_no_hardware(cell: Path) -> None:
    with pytest.raises(ProfileError, match="placeholder"):
        load_rig(cell)
    rig = read_rig(cell)
    assert rig.name == "cell" and not rig.simulated and rig.fingerprint == load_rig(cell, simulated=True).fingerprint
    cell.write_text(cell.read_text().replace("force_max_n:", "force_most_n:"))
    with pytest.raises(ProfileError, match="force_most_n"):
        read_rig(cell)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["registers", "--format", "python", "--rig", "cell.yaml"], "class Client"),
        (["calibration", "show", "1", "--rig", "cell.yaml", "--state", "state"], "demo"),
        (["recordings", "prune", "--rig", "cell.yaml", "--state", "state"], "rig cell.yaml retains everything"),
        (["report", "b.tar.gz", "--rig", "cell.yaml", "--state", "state"], "rig.txt"),
    ],
    ids=lambda value: value[0] if isinstance(value, list) else None,
)
def test_a_verb_that_opens_no_port_asks_for_none(words: list[str], told: str, call: Any) -> None:
    answer = call(*words)
    assert "placeholder" not in answer.output.replace("# EDIT", "") and told in answer.output


def test_its_file_is_in_the_bundle(cell: Path, call: Any) -> None:
    call("report", "b.tar.gz", "--rig", "cell.yaml", "--state", "state")
    with tarfile.open(cell.with_name("b.tar.gz")) as bundle:
        text = bundle.extractfile("force-gateway-report/rig.txt")
        assert text is not None and b"name: cell" in text.read()


def test_what_was_recorded_on_it_is_compared_with_its_limits(cell: Path) -> None:
    by_name, by_file = find_rig("cell", str(cell))[0], find_rig(str(cell), "")[0]
    assert by_name is not None and by_file is not None and by_name.fingerprint == by_file.fingerprint
    assert load_rig_or_none(StateChoice(path=cell.parent / "state", named=str(cell))) is not None
