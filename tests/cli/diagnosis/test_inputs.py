"""What a diagnosis loads before it begins: of seconds, imports are the largest part that nobody sees. And what it refuses."""

import contextlib
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from gateway.cli.diagnosis.inputs import read_sources
from gateway.cli.errors import CliError
from gateway.cli.main import command
from gateway.cli.recordings.named_recording import recording_path
from gateway.recording import Recording, RecordingError
from gateway.recording.export import export_csv

_ONLY_FOR_RIGS = ("gateway.control.controller", "gateway.profiles.rigs.rig_file", "gateway.devices.codecs")
_ONLY_FOR_SOME = ("scipy", "asyncio", "gateway.reports.diagnosis.page", "gateway.service.closed_loop.study")


def test_a_table_that_names_no_rig_is_diagnosed_without_what_reads_rigs_and_writes_reports(tmp_path: Path) -> None:
    columns = np.stack([np.arange(200) * 0.01, np.arange(200.0), np.arange(200) * 0.02], axis=1)
    np.savetxt(tmp_path / "a.csv", columns, delimiter=",", header="time_s,force_n,command_v", comments="")
    script = (
        "import sys; import gateway.cli.diagnosis.answer; from gateway.cli.diagnosis.inputs import read_sources\n"
        f"sources = read_sources([{str(tmp_path / 'a.csv')!r}], rig=None, columns=None, state=None)\n"
        f"print(sources.plant.name, [each for each in {(*_ONLY_FOR_RIGS, *_ONLY_FOR_SOME)!r} if each in sys.modules])"
    )
    told = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    assert told.split()[1:] == ["[]"]


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("{0}", "{1}"), "is named twice"),
        (("{0}", "--against", "{1}"), "is named twice"),
        (("{0}", "--against", "{2}", "--against", "{2}"), "is named twice"),
        (("{0}", "--against", "{3}"), "is a copy of {0}"),
    ],
)
def test_a_recording_is_no_evidence_for_itself(words: tuple[str, ...], why: str, tmp_path: Path) -> None:
    """Named twice, its noise was what two recordings had in common; against itself, whatever was found was no change. The
    rig's reference is a copy of a recording."""
    for name, period in (("a.csv", 7), ("b.csv", 8)):
        rows = "".join(f"{k / 100},{k % 5},{k % period}\n" for k in range(400))
        (tmp_path / name).write_text("time_s,command_v,force_n\n" + rows)
    (tmp_path / "same.csv").symlink_to(tmp_path / "a.csv")
    shutil.copy(tmp_path / "a.csv", tmp_path / "copy.csv")
    files = [tmp_path / name for name in ("a.csv", "same.csv", "b.csv", "copy.csv")]
    refused = CliRunner().invoke(command, ["diagnose", *(word.format(*files) for word in words), "--rig", "demo"])
    assert refused.exit_code == 2
    assert f"{why.format(*files)}: a recording is no evidence for itself" in refused.stderr


def test_a_recording_is_meant_by_its_file_its_number_or_as_the_last_one(tmp_path: Path) -> None:
    """Whoever has just recorded knows no number; a file of such a name is that file."""
    with pytest.raises(CliError, match=f"E403 no recording in {tmp_path}: "):
        recording_path("last", None, tmp_path)
    (tmp_path / "recordings").mkdir()
    for number in (9, 10):
        (tmp_path / f"recordings/{number:04d}.fgr").touch()
    assert recording_path("last", None, tmp_path) == tmp_path / "recordings/0010.fgr"
    assert recording_path("9", None, tmp_path) == tmp_path / "recordings/0009.fgr"
    with pytest.raises(RecordingError, match=r"no recording 8 in .*; there: 9, 10"):
        recording_path("8", None, tmp_path)
    with contextlib.chdir(tmp_path):
        for name in ("last", "9"):
            Path(name).touch()
            assert recording_path(name, None, tmp_path) == Path(name)


@pytest.mark.parametrize("old", [("still.csv",), ("still.csv", "moves.csv")], ids=["alone", "beside one that does"])
def test_a_machine_at_rest_is_none_to_compare_with(old: tuple[str, ...], tmp_path: Path, call: Any) -> None:
    """Of the same machine, unchanged, presliding or crosstalk was told as a change since."""
    noise_n = np.random.default_rng(5).normal(0.0, 0.1, (3, 500))
    time_s = np.arange(500) * 0.02
    for at, (name, swing_v) in enumerate((("new.csv", 1.0), ("still.csv", 0.0), ("moves.csv", 1.0))):
        volts = 2.0 + swing_v * np.sin(time_s)
        rows = np.stack([time_s, volts, 8.0 * volts - 3.0 + noise_n[at]], axis=1)
        np.savetxt(tmp_path / name, rows, delimiter=",", header="time_s,command_v,force_n", comments="")
    against = [word for name in old for word in ("--against", str(tmp_path / name))]
    answer = call("diagnose", str(tmp_path / "new.csv"), *against, "--rig", "demo")
    is_refused = old == ("still.csv",)
    assert answer.exit_code == (65 if is_refused else 0), answer.output
    assert ("E403 still.csv: the command does not move" in answer.stderr) is is_refused


@pytest.mark.parametrize(
    ("header", "names", "is_told"),
    [
        ({"rig_texts": {"demo.yaml": "name: demo"}}, (), True),
        ({"rig_texts": {"demo.yaml": "name: demo"}}, ("sent_v",), True),
        ({"rig_texts": {"demo.yaml": "name: demo"}}, ("sent_v", "sent_age_s"), False),
        ({}, (), False),
    ],
)
def test_a_gateways_recording_without_what_was_sent_says_that_its_names_may_be_that(
    header: dict[str, Any], names: tuple[str, ...], is_told: bool, tmp_path: Path
) -> None:
    """Without these columns the model is driven by what was wanted: one recording had four causes by it, and no word of why."""
    time_s = np.arange(400) * 0.01
    columns = {"time_s": time_s, "command_v": 2.0 + np.sin(time_s), "force_n": 17.0 + np.sin(time_s)}
    columns |= {name: columns["command_v"] if name == "sent_v" else np.full(400, 0.001) for name in names}
    export_csv(Recording(tmp_path / "run.csv", header, columns, 400, truncated=False), tmp_path / "run.csv")
    notes = read_sources([str(tmp_path / "run.csv")], rig="demo", columns=None, state=tmp_path).notes
    told = [note for note in notes if "run.csv has no sent_v and sent_age_s" in note]
    assert bool(told) == is_told
    assert not told or "what was wanted" in told[0]
