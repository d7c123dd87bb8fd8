"""The audit on its way to the disk: nothing is lost that memory holds, and what is lost is counted."""

import asyncio
import errno
import random
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import pytest

from gateway.audit import audit_log as audit_log_module
from gateway.audit.audit_file import AuditFile, Place, Written
from gateway.audit.audit_log import MOST_WAITING, AuditLog
from gateway.audit.audit_reader import read_audit, verify_audit
from gateway.processes.event import utc_text
from tests.audit.appending import append


class FailingFile:
    """Takes records while `is_full` is not set, and syncs while `is_broken` is not."""

    def __init__(self) -> None:
        self.is_full = self.is_broken = self.is_closed = False
        self.taken: list[dict[str, Any]] = []
        self.synced = 0

    def write(self, records: Iterable[dict[str, Any]], *, again: bool = False) -> Written:
        if again:
            del self.taken[self.synced :]
        if self.is_full:
            raise OSError(errno.ENOSPC, "No space left on device")
        self.taken.extend(records)
        return Written(Place(len(self.taken)))

    def sync(self, place: Place) -> None:
        if self.is_broken:
            raise OSError(errno.EIO, "Input/output error")
        self.synced = place.size

    def close(self) -> None:
        self.is_closed = True


def audit_log(file: Any, said: list[str], now: Callable[[], float]) -> AuditLog:
    log = AuditLog(file, lambda cause, sentence: said.append(sentence), now, lambda: 1.7e9 + now())

    def at_once(work: Callable[[], Any], done: Callable[[Any], None]) -> None:
        try:
            result = work()
        except OSError as error:
            result = error
        done(result)

    log.run_in_background = log.sync_in_background = at_once
    return log


def test_a_full_disk_is_an_alarm_and_nothing_is_lost_that_memory_holds() -> None:
    file, said, now = FailingFile(), list[str](), [0.0]
    log = audit_log(file, said, lambda: now[0])
    file.is_full = True
    for k in range(MOST_WAITING + 300):
        now[0] += 0.01
        log.put({"k": k})
        log.flush()
    assert len(said) == 1 and said[0].startswith(
        "A351 the audit is not stored: No space left on device: the disk is full; kept in memory"
    )
    file.is_full = False
    now[0] += 10.0
    log.flush()
    lost, *kept = file.taken
    assert (lost["what"], lost["count"]) == ("lost", 300)
    assert [record["k"] for record in kept] == list(range(300, MOST_WAITING + 300))
    assert said[-1].startswith("A351 the audit is stored again")


def test_each_failure_of_the_disk_is_told_and_each_end_of_one_once() -> None:
    """The second one behind a day that went well is an alarm as the first was; what is stored in between is no news."""
    file, said, now = FailingFile(), list[str](), [0.0]
    log = audit_log(file, said, lambda: now[0])
    for is_full in (True, False, False, True, True, False):
        file.is_full = is_full
        now[0] += 100.0
        log.put({"k": now[0]})
        log.flush()
    assert [sentence[:33] for sentence in said] == [
        "A351 the audit is not stored: No ",
        "A351 the audit is stored again, 2",
        "A351 the audit is not stored: No ",
        "A351 the audit is stored again, 3",
    ]
    assert len(file.taken) == 6


def test_what_a_full_disk_kept_back_is_written_at_the_end_where_it_is_free_again() -> None:
    """Found by tests/simulation: the file stayed open, and what came after the failure was lost."""

    async def run() -> FailingFile:
        file = FailingFile()
        log = audit_log(file, [], lambda: 0.0)

        def later(work: Callable[[], Any], done: Callable[[Any], None]) -> None:
            at_once = asyncio.get_running_loop().call_later
            try:
                at_once(0.01, done, work())
            except OSError as error:
                at_once(0.01, done, error)

        log.run_in_background = log.sync_in_background = later
        file.is_full = True
        log.put({"k": 1})
        log.flush()
        await asyncio.sleep(0.02)
        log.put({"k": 2})
        file.is_full = False
        await log.close()
        return file

    file = asyncio.run(run())
    assert [record["k"] for record in file.taken] == [1, 2]
    assert file.is_closed


def test_a_disk_that_hangs_at_the_end_keeps_the_file_that_is_being_written(monkeypatch: pytest.MonkeyPatch) -> None:
    """The thread has its descriptor: closed beneath it, the number may be another file's before the write."""
    monkeypatch.setattr(audit_log_module, "_LAST_WORDS_S", 0.01)

    async def run() -> FailingFile:
        file = FailingFile()
        log = audit_log(file, [], lambda: 0.0)
        log.run_in_background = lambda work, done: None
        log.put({"k": 1})
        await log.close()
        return file

    assert not asyncio.run(run()).is_closed


def test_a_write_that_fails_halfway_leaves_the_chain_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = AuditFile(tmp_path)
    append(file, [{"what": "enable"}])
    monkeypatch.setattr(
        "gateway.audit.audit_file.os.fsync", lambda descriptor: (_ for _ in ()).throw(OSError(28, "full"))
    )
    with pytest.raises(OSError, match="full"):
        append(file, [{"what": "disable"}])
    monkeypatch.undo()
    append(file, [{"what": "disable"}])
    file.close()
    assert [record["what"] for record in read_audit(tmp_path)] == ["enable", "disable"]
    assert not verify_audit(tmp_path).broken


def test_each_loss_is_told_with_its_own_times() -> None:
    """A full disk in spring, and one in autumn: nothing was lost between them."""
    file, said, now = FailingFile(), list[str](), [0.0]
    log = audit_log(file, said, lambda: now[0])
    for begin_s in (0.0, 1.0e7):
        file.is_full, now[0] = True, begin_s
        for _ in range(MOST_WAITING + 10):
            log.put({})
        for is_full in (True, False):
            now[0] += 10.0
            file.is_full = is_full
            log.flush()
    lost = [record for record in file.taken if record.get("what") == "lost"]
    spans = [" ".join(f"to {utc_text(1.7e9 + at_s)}" for at_s in (begin_s, begin_s))[3:] for begin_s in (0.0, 1.0e7)]
    assert [record["text"] for record in lost] == [
        f"10 records from {span} were lost: the disk took none, and memory is bounded" for span in spans
    ]


@pytest.mark.parametrize("seed", range(12))
def test_each_record_is_written_once_in_its_order_or_counted_as_lost(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever is put down, under way or refused meanwhile; a disk that has refused is left alone for five seconds."""
    monkeypatch.setattr(audit_log_module, "MOST_WAITING", 5)
    rng, file, now, refused_s = random.Random(seed), FailingFile(), [0.0], -10.0
    log = audit_log(file, [], lambda: now[0])
    under_way: list[tuple[Callable[[], Any], Callable[[Any], None]]] = []
    syncing: list[tuple[Callable[[], Any], Callable[[Any], None]]] = []
    log.run_in_background = lambda work, done: under_way.append((work, done))
    log.sync_in_background = lambda work, done: syncing.append((work, done))
    put_s: list[float] = []
    for turn in range(84):
        now[0] += rng.choice((0.1, 1.0, 6.0)) if turn < 78 else 6.0
        for _ in range(rng.randrange(5) if turn < 78 else 0):
            log.put({"k": len(put_s)})
            put_s.append(now[0])
        was_idle = not under_way
        log.flush()
        assert not (was_idle and under_way) or now[0] >= refused_s + 5.0
        assert len(log._waiting) <= 5 and len(log._written) < 11
        for queue in rng.sample((under_way, syncing), 2):
            if queue and (turn >= 78 or rng.random() < 0.6):
                work, done = queue.pop()
                try:
                    file.is_full = file.is_broken = turn < 78 and rng.random() < 0.6
                    done(work())
                except OSError as error:
                    refused_s = now[0]
                    done(error)
    written = [record["k"] for record in file.taken if "k" in record]
    assert written == sorted(set(written))
    missing = iter([k for k in range(len(put_s)) if k not in written])
    for lost in (record for record in file.taken if record.get("what") == "lost"):
        these = [next(missing) for _ in range(lost["count"])]
        span = " to ".join(utc_text(1.7e9 + put_s[k]) for k in (these[0], these[-1]))
        assert lost["text"].startswith(f"{len(these)} records from {span} were lost")
    assert not list(missing)
