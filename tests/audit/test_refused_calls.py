"""A disk that refuses one call of the audit: what of it is there then, until the next call, and behind that."""

import errno
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from gateway.audit import audit_file
from gateway.audit.audit_file import AuditFile, audit_files
from gateway.audit.audit_reader import read_audit, verify_audit
from tests.audit.appending import append
from tests.audit.test_chain import FILE_BYTES, records


@contextmanager
def refusing(monkeypatch: pytest.MonkeyPatch, owner: object, name: str, number: int = 1) -> Iterator[list[int]]:
    """Have the call of this number refused, for this block. Yields how many came."""
    call: Callable[..., object] = getattr(owner, name)
    came = [0]

    def refuse(*arguments: object) -> object:
        came[0] += 1
        if came[0] == number:
            raise OSError(errno.EIO, "Input/output error")
        return call(*arguments)

    with monkeypatch.context() as patched:
        patched.setattr(owner, name, refuse)
        yield came


def test_half_a_line_does_not_wait_for_the_next_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever verifies meanwhile would read of an incomplete line; a full disk may stay full for days."""
    file, write = AuditFile(tmp_path, FILE_BYTES), os.write
    append(file, records(2))
    (path,) = audit_files(tmp_path / "audit")
    whole = path.read_bytes()
    with monkeypatch.context() as halving:
        halving.setattr(os, "write", lambda descriptor, data: write(descriptor, data[:20]))
        with refusing(monkeypatch, os, "write", 2), pytest.raises(OSError, match="Input/output"):
            append(file, records(1, 3))
    assert path.read_bytes() == whole and not verify_audit(tmp_path).notes
    file.close()


def test_no_file_is_told_as_dropped_that_is_still_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whichever sync is refused: such a line is evidence that those of before are rightly gone."""
    for number in range(1, 60):
        state = tmp_path / str(number)
        file = AuditFile(state, FILE_BYTES, kept=2)
        with refusing(monkeypatch, os, "fsync", number) as came:
            for record in records(20):
                try:
                    append(file, [record])
                except OSError:
                    append(file, [record])
                there = list(read_audit(state))
                dropped = max((int(each["dropped_to"]) for each in there if each["what"] == "dropped"), default=0)
                assert dropped < int(there[0]["n"]), (number, record)
        file.close()
        assert verify_audit(state).broken is None
        if came[0] < number:
            break
    assert 20 < number < 59 and len(audit_files(state / "audit")) == 2


def test_a_new_file_whose_name_was_not_synced_is_synced_before_its_first_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else a power cut would take the file, and what was acknowledged in it."""
    file = AuditFile(tmp_path, FILE_BYTES)
    append(file, records(2))
    (path,) = audit_files(tmp_path / "audit")
    path.unlink()
    with refusing(monkeypatch, audit_file, "sync_path") as came:
        with pytest.raises(OSError, match="Input/output"):
            append(file, records(1, 3))
        append(file, records(1, 3))
    file.close()
    assert came == [2] and [each["what"] for each in read_audit(tmp_path)] == ["chain broken", "force_setpoint"]
