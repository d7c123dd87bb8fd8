"""What a verb writes replaces a plain file only: never the pipe, socket or device of that name, and never a link to it.

Not tried with a device: where the program is at fault root would lose it."""

import errno
import os
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import Result

from gateway.cli.diagnosis.outputs import check_targets, write_all
from gateway.processes.durable_file import replace_text
from tests.other_kinds import never_waiting, put
from tests.recording.care.test_care import record

Call = Callable[..., Result]
VERBS = ("backup out", "report out", "recordings export 1 -o out", "recordings export 1 --parquet -o out")


@pytest.fixture
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    record(tmp_path / "state", rig="demo")
    return tmp_path / "state"


@pytest.mark.parametrize("kind", ["a pipe", "a socket"])
@pytest.mark.parametrize("verb", VERBS)
def test_no_verb_puts_a_file_in_place_of_what_is_none(verb: str, kind: str, state: Path, call: Call) -> None:
    """As root `report /dev/null --force` made /dev/null a file, for the whole machine."""
    place = put(kind, state.parent / "out")
    before = os.lstat(place)
    with never_waiting():
        answer = call(*verb.split(), "--force", "--state", "state")
    assert os.path.samestat(os.lstat(place), before)
    assert answer.exit_code == 1 and answer.output.startswith("E106 ") and f"it is {kind}, and no file" in answer.output
    assert sorted(path.name for path in state.parent.iterdir()) == ["out", "state"]


@pytest.mark.parametrize("kind", ["a pipe", "a socket", "a directory"])
def test_a_report_of_a_fit_replaces_nothing_but_a_file(kind: str, tmp_path: Path) -> None:
    place = put(kind, tmp_path / "out")
    with pytest.raises(OSError, match=f"it is {kind}"):
        replace_text(place, "a report")
    assert [path.name for path in tmp_path.iterdir()] == ["out"] and not place.is_file()


@pytest.mark.parametrize("verb", VERBS)
def test_what_a_link_leads_to_is_written_and_the_link_stays(verb: str, state: Path, call: Call) -> None:
    """Such as /dev/stdout, which leads to the file that the shell has opened."""
    (state.parent / "there").write_text("before")
    (state.parent / "out").symlink_to("there")
    answer = call(*verb.split(), "--force", "--state", "state")
    assert answer.exit_code == 0, answer.output
    assert (state.parent / "out").is_symlink() and (state.parent / "there").read_bytes() != b"before"


def test_a_directory_among_the_names_is_told_before_anything_is_computed_or_written(tmp_path: Path) -> None:
    """`diagnose --json DIR --report why.html` wrote the report, minutes later, and only then told."""
    targets = [tmp_path / "why.html", tmp_path]
    with pytest.raises(IsADirectoryError):
        check_targets(targets, [])
    with pytest.raises(IsADirectoryError):
        write_all(dict.fromkeys(targets, "a page"))
    assert not (tmp_path / "why.html").exists()


def test_pages_are_written_where_a_link_leads_to(tmp_path: Path) -> None:
    (tmp_path / "there").write_text("before")
    (tmp_path / "out").symlink_to("there")
    write_all({tmp_path / "out": "a page"})
    assert (tmp_path / "out").is_symlink() and (tmp_path / "there").read_text() == "a page"


def test_a_link_that_leads_in_a_circle_is_no_file_to_write_to(state: Path, call: Call) -> None:
    """It was an internal error."""
    (state.parent / "out").symlink_to("out")
    answer = call("calibration", "compare", "1", "1", "--plot", "out", "--state", "state")
    assert answer.exit_code == 1 and answer.output.startswith("E106 ") and "Too many levels" in answer.output
    assert (state.parent / "out").is_symlink()


@pytest.mark.parametrize("verb", [*VERBS, "recordings plot 1 -o out.svg"])
def test_a_folder_that_is_not_there_is_told_by_its_own_name(verb: str, state: Path, call: Call) -> None:
    """What was told was the name of a file beside it, which nobody had given: `.run.csv.9277`."""
    answer = call(*verb.replace("out", "nowhere/out").split(), "--state", "state")
    assert (answer.exit_code, answer.output) == (1, "E106 nowhere: no such directory\n")


def test_a_recording_is_exported_as_its_file_is_called(state: Path, call: Call) -> None:
    """`-o run.parquet` wrote a CSV of that name."""
    assert call("recordings", "export", "1", "-o", "run.parquet", "--state", "state").exit_code == 0
    assert (state.parent / "run.parquet").read_bytes()[:4] == b"PAR1"
    assert call("recordings", "export", "1", "-o", "run.txt", "--state", "state").exit_code == 0
    assert (state.parent / "run.txt").read_text().startswith("# ")


@pytest.mark.parametrize("name", ["loops.bmp", "loops.SVG", "loops.html.gz"])
@pytest.mark.parametrize("words", [("calibration", "compare", "demo", "demo"), ("plant", "compare", "0", "0")])
def test_a_page_under_the_name_of_a_picture_is_refused(
    words: tuple[str, ...], name: str, state: Path, call: Call
) -> None:
    """The HTML was written there, and no program opened it."""
    answer = call(*words, "--plot", name, "--state", "state")
    assert answer.exit_code == 2 and f"{name}: an HTML file ends in .html" in answer.output, answer.output
    assert not (state.parent / name).exists()


def test_a_disk_that_is_full_is_told_with_the_file_that_was_asked_for() -> None:
    """'No space left on device' named none."""
    with pytest.raises(OSError) as caught:
        write_all({Path("/dev/full"): "a page"})
    assert (caught.value.errno, caught.value.filename) == (errno.ENOSPC, "/dev/full")
