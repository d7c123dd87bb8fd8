"""Another format is not guessed at; of what is deleted its number is taken before it goes, and no mark stays."""

from pathlib import Path

import pytest

from gateway.recording import Recorder, RecordingError, read_recording
from gateway.recording.care.keeping import delete_recording, keep_recording, let_recording_go


def recorded(state: Path, **header: object) -> Path:
    recorder = Recorder(state / "recordings", {"rig": "demo", **header}, ("time_s", "force_n"))
    recorder.append((0.0, 1.0))
    recorder.close()
    return recorder.path


@pytest.mark.parametrize("number", [0, 2, 3])
def test_a_recording_of_another_format_is_refused_by_its_number(tmp_path: Path, number: int) -> None:
    """What its columns mean nobody here can know: read all the same, its forces would be others."""
    assert read_recording(recorded(tmp_path)).rows == 1
    with pytest.raises(RecordingError, match=f"is of format {number}; this version reads format 1"):
        read_recording(recorded(tmp_path, format=number))


def test_the_number_of_the_last_recording_is_taken_before_its_file_goes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Killed between the two, the next recording would have its number, and a calibration would name the wrong one."""
    path, unlink, was_marked = recorded(tmp_path), Path.unlink, list[bool]()

    def noting(one: Path, missing_ok: bool = False) -> None:
        was_marked.append(one.with_suffix(".gone").exists())
        unlink(one, missing_ok)

    monkeypatch.setattr(Path, "unlink", noting)
    assert delete_recording(path, "") == ""
    assert was_marked == [True]


def test_what_was_kept_for_a_recording_goes_with_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Somebody may keep it at the very moment at which it goes: its mark would lie there for good."""
    path = recorded(tmp_path)
    unlink = Path.unlink

    def kept_late(one: Path, missing_ok: bool = False) -> None:
        one.with_suffix(".keep").write_bytes(b"")
        unlink(one, missing_ok)

    keep_recording(path)
    let_recording_go(path)
    monkeypatch.setattr(Path, "unlink", kept_late)
    assert delete_recording(path, "") == ""
    assert sorted(one.name for one in path.parent.iterdir()) == ["0001.gone"]
