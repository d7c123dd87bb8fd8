"""Lines are written as they come and synced behind: what a kill leaves of them, a power cut, and a sync that fails."""

import asyncio
import errno
import os
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from gateway.audit import audit_log as audit_log_module
from gateway.audit.audit_file import AuditFile, audit_files
from gateway.audit.audit_log import AuditLog
from gateway.audit.audit_reader import read_audit, verify_audit
from tests.audit.appending import append
from tests.audit.test_chain import FILE_BYTES, files_of, records

LATE_S = 20.0


class HeldSync:
    """Each fsync of a file of the audit waits until it may go on; `refuses`: and is told of a broken disk then."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.begun, self.may_go_on, self.refuses = threading.Semaphore(0), threading.Semaphore(0), False
        sync = os.fsync

        def hold(descriptor: int) -> None:
            if Path(f"/proc/self/fd/{descriptor}").readlink().name.endswith(".jsonl"):
                self.begun.release()
                assert self.may_go_on.acquire(timeout=LATE_S)
                if self.refuses:
                    raise OSError(errno.EIO, "Input/output error")
            sync(descriptor)

        monkeypatch.setattr("gateway.audit.audit_file.os.fsync", hold)


@pytest.fixture
def held(monkeypatch: pytest.MonkeyPatch) -> Iterator[HeldSync]:
    held = HeldSync(monkeypatch)
    yield held
    held.may_go_on.release(1000)


def olds(state: Path) -> list[int]:
    return [fields["old"] for fields in read_audit(state) if "old" in fields]


async def until(is_so: Callable[[], Any]) -> None:
    async with asyncio.timeout(LATE_S):
        while not is_so():
            await asyncio.sleep(0.001)


async def put_all(log: AuditLog, state: Path, numbers: range) -> None:
    """Put them one by one, each once the one before is in the file."""
    for number in numbers:
        log.put(records(1, number)[0])
        log.flush()
        await until(lambda: not log._in_flight)
        log.flush()
    await until(lambda: olds(state)[-1:] == [numbers[-1]])


def test_what_comes_while_a_sync_takes_its_time_is_written_and_a_kill_takes_none(
    tmp_path: Path, held: HeldSync
) -> None:
    """It waited for that sync: killed two seconds after its start, with a sync of one second, control left 2 of 26."""

    async def scene() -> None:
        log = AuditLog(AuditFile(tmp_path), lambda *told: None, lambda: 0.0, lambda: 1.7e9)
        await put_all(log, tmp_path, range(1, 8))
        assert held.begun.acquire(timeout=LATE_S) and not held.begun.acquire(blocking=False)
        assert olds(tmp_path) == [*range(1, 8)]
        head = (tmp_path / "audit" / "head").read_text()
        assert '"n": 0' in head, "nothing is vouched for before it is synced"
        assert verify_audit(tmp_path).broken is None
        held.may_go_on.release(100)
        await log.close()
        assert '"n": 7' in (tmp_path / "audit" / "head").read_text()

    asyncio.run(scene())
    assert verify_audit(tmp_path).end.number == 7


def test_what_a_failed_sync_was_for_and_all_behind_it_is_written_again_once(tmp_path: Path, held: HeldSync) -> None:
    told, now = list[str](), [0.0]

    async def scene() -> None:
        log = AuditLog(AuditFile(tmp_path), lambda _, said: told.append(said), lambda: now[0], lambda: 1.7e9)
        await put_all(log, tmp_path, range(1, 4))
        held.refuses = True
        held.may_go_on.release()
        await until(lambda: told)
        held.refuses = False
        held.may_go_on.release(100)
        log.put(records(1, 4)[0])
        log.flush()
        assert not log._in_flight, "a disk that has refused is left alone for a while"
        now[0] += 10.0
        log.flush()
        await log.close()

    asyncio.run(scene())
    assert olds(tmp_path) == [1, 2, 3, 4] and verify_audit(tmp_path).broken is None
    assert verify_audit(tmp_path).end.number == 4
    assert [said[:36] for said in told] == [
        "A351 the audit is not stored: Input/",
        "A351 the audit is stored again, 4 re",
    ]


def test_behind_a_sync_that_hangs_memory_is_bounded_and_a_close_waits_no_longer(
    tmp_path: Path, held: HeldSync, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(audit_log_module, "MOST_WAITING", 5)
    monkeypatch.setattr(audit_log_module, "_LAST_WORDS_S", 0.05)

    async def scene() -> None:
        file = AuditFile(tmp_path)
        log = AuditLog(file, lambda *told: None, lambda: 0.0, lambda: 1.7e9)
        await put_all(log, tmp_path, range(1, 6))
        for number in range(6, 30):
            log.put(records(1, number)[0])
            log.flush()
        assert (len(log._written), len(log._waiting), log._lost.number) == (5, 5, 19)
        await log.close()
        assert file._descriptor >= 0, "the thread that syncs has it"
        held.may_go_on.release(100)
        log._workers[1]._threads.shutdown()
        file.close()

    asyncio.run(scene())
    assert olds(tmp_path) == [1, 2, 3, 4, 5]


def test_a_file_that_is_removed_or_full_while_a_sync_is_under_way_is_left_behind_it(tmp_path: Path) -> None:
    """Another one is begun when nobody syncs this one any more."""
    file = AuditFile(tmp_path, longest_bytes=1 << 20)
    written = file.write(records(1, 1))
    assert written
    files_of(tmp_path)[0].unlink()
    assert file.write(records(1, 2)) is None
    file.sync(written.place)
    written = file.write(records(1, 2))
    assert written and written.found and olds(tmp_path) == [2]
    file._longest_bytes = 1
    assert file.write(records(1, 3)) is None
    file.sync(written.place)
    assert file.write(records(1, 3)) and olds(tmp_path) == [2, 3] and len(files_of(tmp_path)) == 2
    file.close()


def test_no_more_is_taken_for_synced_than_a_sync_was_asked_for(tmp_path: Path) -> None:
    """What is written while it begins is put down again where the next one fails: it would be there twice."""
    file = AuditFile(tmp_path)
    first = file.write(records(1, 1))
    assert first and file.write(records(1, 2))
    file.sync(first.place)
    assert file.write(records(2, 2), again=True)
    file.close()
    assert olds(tmp_path) == [1, 2, 3] and verify_audit(tmp_path).broken is None


@pytest.mark.parametrize(
    ("hole", "filler"),
    [(range(1, 2), b"\0"), (range(2, 3), b"\0"), (range(1, 4), b"\0"), (range(1, 2), b""), (range(2, 3), b"")],
)
def test_what_a_power_cut_has_left_of_lines_behind_the_head_is_cut_off_and_no_tampering(
    tmp_path: Path, hole: range, filler: bytes
) -> None:
    """A later page is on the disk, an earlier one is not, or a file system has left it out. Of the lines up to the head none
    may be missing."""
    file = AuditFile(tmp_path, FILE_BYTES * 10)
    append(file, records(2))
    for number in range(3, 7):
        file.write(records(1, number))
    file.close()
    (path,) = audit_files(tmp_path / "audit")
    lines = path.read_bytes().splitlines(keepends=True)
    for k in hole:
        lines[2 + k] = filler * len(lines[2 + k])
    path.write_bytes(b"".join(lines))
    verdict = verify_audit(tmp_path)
    assert verdict.broken is None and (verdict.end.number, len(verdict.notes)) == (2 + hole[0], 1)
    file = AuditFile(tmp_path)
    assert append(file, records(1, 9)) == ()
    file.close()
    assert olds(tmp_path) == [*range(1, 3 + hole[0]), 9] and verify_audit(tmp_path).notes == ()
    torn = [fields["text"] for fields in read_audit(tmp_path) if fields["what"] == "torn line"]
    assert len(torn) == 1 and torn[0].startswith(str(len(b"".join(lines[2 + hole[0] :]))))


def test_a_line_that_was_altered_up_to_the_head_stays_and_so_does_what_stands_behind(tmp_path: Path) -> None:
    file = AuditFile(tmp_path)
    append(file, records(3))
    file.write(records(1, 4))
    file.close()
    (path,) = audit_files(tmp_path / "audit")
    altered = path.read_bytes().replace(b'"old": 3', b'"old": 9')
    path.write_bytes(altered)
    assert verify_audit(tmp_path).broken
    file = AuditFile(tmp_path)
    (told,) = append(file, records(1, 5))
    file.close()
    assert told.startswith("A352") and path.read_bytes().startswith(altered) and verify_audit(tmp_path).broken


def test_what_a_start_has_found_is_told_once_the_disk_takes_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A full disk at the first start behind a kill: neither the torn line nor what was removed was ever told."""
    file = AuditFile(tmp_path)
    append(file, records(3))
    file.close()
    (path,) = audit_files(tmp_path / "audit")
    path.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:2]) + b'{"n": 3, "pr')
    file = AuditFile(tmp_path)
    with monkeypatch.context() as full:
        full.setattr(os, "write", lambda *_: (_ for _ in ()).throw(OSError(errno.ENOSPC, "full")))
        with pytest.raises(OSError, match="full"):
            append(file, records(1, 4))
    (told,) = append(file, records(1, 4))
    file.close()
    assert told.startswith("A352 the audit ends with line 2, it had 3")
    assert [fields["what"] for fields in read_audit(tmp_path)][2:] == ["torn line", "chain broken", "force_setpoint"]
