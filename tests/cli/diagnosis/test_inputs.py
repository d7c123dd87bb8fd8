"""What a diagnosis loads before it begins: of seconds, imports are the largest part that nobody sees. And what it refuses."""

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from gateway.cli.main import command

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
