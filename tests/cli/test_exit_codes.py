"""What scripts and a service act on: the exit code of each kind of error (sysexits.h)."""

import errno
import os
from pathlib import Path

import pytest

from gateway.cli.errors import no_state_directory, no_such_recording, translate_error
from gateway.extras import MissingExtraError
from gateway.ports import PortError
from gateway.profiles import ProfileError
from gateway.recording import RecordingError


@pytest.mark.parametrize(
    ("error", "exit_code", "code"),
    [
        (ProfileError(()), 78, ""),
        (RecordingError("a.csv: no column"), 65, "E403"),
        (MissingExtraError("E160 numba is not installed"), 69, "E160"),
        (PortError("E101", "/dev/ttyS0: not allowed"), 77, "E101"),
        (PortError("E103", "/dev/ttyS0: held by another"), 69, "E103"),
        (OSError(errno.EACCES, os.strerror(errno.EACCES), "/etc/x"), 77, "E105"),
        (OSError(errno.EPERM, os.strerror(errno.EPERM), "/etc/x"), 77, "E105"),
        (OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "/var/x"), 1, "E106"),
        (ZeroDivisionError("division"), 1, "E500"),
    ],
    ids=["configuration", "data", "extra", "port permission", "port held", "EACCES", "EPERM", "full disk", "internal"],
)
def test_an_error_that_no_verb_has_caught_ends_with_its_code(error: Exception, exit_code: int, code: str) -> None:
    told = translate_error(error, "run demo", debug=False)
    assert told.exit_code == exit_code and told.message.startswith(code)


def test_what_is_not_there_is_a_fault_of_the_data() -> None:
    assert no_state_directory(Path("/nowhere")).exit_code == no_such_recording(Path("7")).exit_code == 65


def test_a_working_directory_that_was_deleted_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`backup cell.tar.gz` there said "E106 No such file or directory", of what it did not say."""
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    with pytest.raises(FileNotFoundError) as refused:
        Path("cell.tar.gz").absolute()
    assert (
        "the directory that you are in has been deleted"
        in translate_error(refused.value, "backup", debug=False).message
    )
