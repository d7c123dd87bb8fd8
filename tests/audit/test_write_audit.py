"""What the audit keeps of a bank's writes: every edge, every refusal, setpoints in few lines, and a disk that takes nothing."""

import asyncio
import errno
import struct
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import pytest

from gateway.audit.audit_file import AuditFile
from gateway.audit.audit_log import MOST_WAITING, AuditLog
from gateway.audit.audit_reader import read_audit, verify_audit
from gateway.audit.write_audit import WriteAudit
from gateway.modbus import ModbusError, Peer, Role
from gateway.processes.event import utc_text
from gateway.profiles import load_register_map
from gateway.registers import BankRules, RegisterBank
from gateway.registers.command import Status
from gateway.registers.words import State

ROBOT, OTHER = Peer("10.0.0.5", 4711, "robot", Role.SETPOINT), Peer("10.0.0.6", 4712)


class Watched:
    """A bank under audit, in virtual time."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self.kept: list[dict[str, Any]] = []
        self.bank = RegisterBank(
            load_register_map("force-v1"), BankRules(rig_name="demo", force_max_n=60.0), now=self.clock
        )
        self.audit = WriteAudit(lambda fields: self.kept.append(dict(fields)), self.clock)
        self.bank.on_write, self.bank.on_refused_write = self.audit.note_command, self.audit.note_refusal

    def clock(self) -> float:
        return self.now_s

    def write(self, peer: Peer, address: int, *words: int) -> None:
        try:
            self.bank.write_registers(address, struct.pack(f">{len(words)}H", *words), peer)
        except ModbusError:
            pass

    def told(self, *names: str) -> list[tuple[Any, ...]]:
        return [tuple(record.get(name) for name in names) for record in self.kept]


@pytest.fixture
def watched() -> Watched:
    return Watched()


def test_who_what_old_new_and_result_are_kept(watched: Watched) -> None:
    watched.write(ROBOT, 0, 1, 1200)
    assert watched.told("peer", "role", "what", "old", "new", "result") == [
        ("robot (10.0.0.5:4711)", "setpoint", "enable", 0.0, 1.0, "accepted"),
        ("robot (10.0.0.5:4711)", "setpoint", "owner", None, "certificate robot", "accepted"),
        ("robot (10.0.0.5:4711)", "setpoint", "force_setpoint", 0.0, 12.0, "accepted"),
    ]
    watched.kept.clear()
    watched.write(OTHER, 1, 1300)
    (refused,) = watched.kept
    assert (refused["peer"], refused["result"], refused["address"]) == ("10.0.0.6:4712", "W210", 1)
    assert refused["text"].startswith("W210 certificate robot owns the setpoint")
    watched.write(OTHER, 0, 0)
    assert ("disable", 1.0, 0.0) in watched.told("what", "old", "new")


def test_a_stop_of_a_run_that_this_machine_has_begun_is_kept_although_no_bit_falls(watched: Watched) -> None:
    watched.write(OTHER, 0, 0)
    assert watched.kept == []
    watched.bank.publish(Status(state=State.CALIBRATING))
    watched.write(OTHER, 0, 0)
    assert watched.told("peer", "what", "result") == [("10.0.0.6:4712", "stop", "accepted")]


def test_a_value_is_kept_in_the_unit_of_its_register(watched: Watched) -> None:
    registers = load_register_map("force-v1").registers_of("command")
    for register in registers:
        if register.unit:
            watched.write(ROBOT, register.address, 1)
    units = {what: unit for what, unit in watched.told("what", "unit") if what != "owner"}
    assert units == {register.name: register.unit for register in registers if register.unit}


def test_each_line_names_the_connection_that_wrote(watched: Watched) -> None:
    for port, word in ((1, 1), (2, 0), (3, 1)):
        watched.write(Peer("10.0.0.5", port), 0, word)
    told = [(peer, what) for peer, what in watched.told("peer", "what") if what != "owner"]
    assert told == [("10.0.0.5:1", "enable"), ("10.0.0.5:2", "disable"), ("10.0.0.5:3", "enable")]


def test_heartbeats_and_values_written_again_leave_nothing(watched: Watched) -> None:
    watched.write(ROBOT, 0, 1, 1200)
    watched.kept.clear()
    for beat in range(1000):
        watched.write(ROBOT, 0, 1, 1200, 0, 0, beat)
    assert watched.kept == []


def test_an_hour_of_setpoints_at_100_hz_is_a_few_lines_that_lose_no_extreme(watched: Watched) -> None:
    watched.write(ROBOT, 0, 1, 1000)
    watched.kept.clear()
    for k in range(9_000):  # an hour of a slower stream: the windows are the same
        watched.now_s = 0.4 * k
        watched.write(ROBOT, 1, 1000 + k % 7 + (500 if k == 5_000 else 0))
        watched.audit.flush()
    watched.audit.close()
    summaries = [record for record in watched.kept if "count" in record]
    assert len(watched.kept) < 20
    assert max(record["max"] for record in summaries) == pytest.approx(15.0 + (5_000 % 7) / 100)
    assert {record["what"] for record in watched.kept} == {"force_setpoint"}


def test_summaries_come_before_the_edge_that_ends_them(watched: Watched) -> None:
    watched.write(ROBOT, 0, 1, 1000)
    for k in (*range(50), 30):
        watched.write(ROBOT, 1, 1000 + k)
    watched.write(ROBOT, 0, 0)
    assert [what for (what,) in watched.told("what")][-3:] == ["force_setpoint", "disable", "owner"]
    (summary,) = [record for record in watched.kept if "count" in record]
    assert (summary["count"], summary["min"], summary["max"], summary["new"]) == (48 + 2, 10.01, 10.49, 10.30)


@pytest.mark.parametrize("words", [(0, 4), (1, 9999), (0, 3, 1000)])
def test_a_flood_of_edges_or_refusals_is_counted(watched: Watched, words: tuple[int, ...]) -> None:
    """A master that holds tare at 1 in every cycle, or writes what is refused."""
    for k in range(5000):
        watched.now_s = 0.01 * k
        watched.write(ROBOT, *words)
        watched.audit.flush()
    watched.audit.close()
    assert len(watched.kept) < 50
    counts = [record.get("count", 1) for record in watched.kept if record["what"] in ("write", "tare", "reset_fault")]
    assert sum(counts) == 5000


def test_many_peers_do_not_fill_the_memory(watched: Watched) -> None:
    for k in range(3000):
        watched.write(Peer(f"fe80::{k:x}", 1, role=Role.MONITOR), 1, 100)
    assert len(watched.kept) == 3000
    assert len(watched.audit._series) <= 1000


# -- the disk


class FailingFile:
    """Takes records while `is_full` is not set."""

    def __init__(self) -> None:
        self.is_full = self.is_closed = False
        self.taken: list[dict[str, Any]] = []

    def append(self, records: Iterable[dict[str, Any]]) -> None:
        if self.is_full:
            raise OSError(errno.ENOSPC, "No space left on device")
        self.taken.extend(records)

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

    log.run_in_background = at_once
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

        log.run_in_background = later
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


def test_a_write_that_fails_halfway_leaves_the_chain_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = AuditFile(tmp_path)
    file.append([{"what": "enable"}])
    monkeypatch.setattr(
        "gateway.audit.audit_file.os.fsync", lambda descriptor: (_ for _ in ()).throw(OSError(28, "full"))
    )
    with pytest.raises(OSError, match="full"):
        file.append([{"what": "disable"}])
    monkeypatch.undo()
    file.append([{"what": "disable"}])
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
