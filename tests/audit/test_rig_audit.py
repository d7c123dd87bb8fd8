"""The audit of one running rig: who writes, asks and uploads is kept to the end, and what is refused is kept, too."""

import asyncio
import json
import struct
from concurrent.futures import Future
from math import inf, nan
from pathlib import Path
from typing import Any

import pytest

from gateway.audit.audit_reader import read_audit, verify_audit
from gateway.audit.rig_audit import RigAudit
from gateway.modbus import ModbusError, Peer, Role
from gateway.profiles import load_register_map
from gateway.registers import BankRules, RegisterBank
from tests.audit.test_write_audit import ROBOT


def test_what_waits_at_the_end_is_written(tmp_path: Path) -> None:
    async def run() -> None:
        said: list[str] = []
        audit = RigAudit(tmp_path, lambda cause, sentence: said.append(sentence))
        bank = RegisterBank(
            load_register_map("force-v1"), BankRules(rig_name="demo", force_max_n=60.0), now=lambda: 0.0
        )
        audit.watch(bank)
        answers = audit.watch_handlers({"plant": lambda request: {"active": 0}, "health": lambda request: {}})
        bank.write_registers(0, b"\0\1\4\xb0", ROBOT)
        answers["plant"]({"do": "plant"})
        answers["plant"]({"do": "plant", "use": 3})
        answers["health"]({"do": "health"})
        await audit.close()
        assert said == []

    asyncio.run(run())
    assert [record["what"] for record in read_audit(tmp_path)] == ["enable", "owner", "force_setpoint", "plant", "end"]
    assert not verify_audit(tmp_path).broken
    with pytest.raises(FileNotFoundError):
        verify_audit(tmp_path / "audit")


def test_what_is_refused_and_what_is_uploaded_is_kept_too(tmp_path: Path) -> None:
    def refuse(request: dict[str, Any]) -> None:
        raise ValueError("there is no plant 3")

    async def run() -> None:
        audit = RigAudit(tmp_path, lambda cause, sentence: None)
        register_map = load_register_map("force-v1")
        bank = RegisterBank(register_map, BankRules(rig_name="demo", force_max_n=60.0), now=lambda: 0.0)
        audit.watch(bank)
        with pytest.raises(ModbusError):
            bank.write_registers(1, b"\x7f\xff", ROBOT)
        bank.staging.on_select = lambda slot, peer: None
        bank.staging.on_commit = lambda action, words, peer: None
        bank.write_registers(register_map.find("commit").address, b"\0\3", Peer("::1", 1, role=Role.ADMIN))
        bank.write_registers(register_map.find("slot_select").address, b"\0\2", Peer("::1", 1, role=Role.ADMIN))
        with pytest.raises(ValueError, match="no plant 3"):
            audit.watch_handlers({"plant": refuse})["plant"]({"do": "plant", "use": 3})
        await audit.close()

    asyncio.run(run())
    told = [(record["what"], record.get("text") or record["result"]) for record in read_audit(tmp_path)]
    assert told[1:] == [
        ("commit", "rollback"),
        ("slot_select", "slot 2"),
        ("plant", "there is no plant 3"),
        ("end", "accepted"),
    ]
    assert told[0][0] == "write" and "force_setpoint" in told[0][1]


def test_what_was_accepted_and_came_to_nothing_is_kept_as_that(tmp_path: Path) -> None:
    """A commit whose checks failed stood there as accepted, as one that was put to use did."""

    async def run() -> None:
        audit = RigAudit(tmp_path, lambda cause, sentence: None)
        audit.note_failure("upload by robot (10.0.0.5:4711)", "E401 the whole set, crc: wrong; active set 1 unchanged")
        audit.note_failure("calibration use 3", "A499 internal error, please report it:\nTraceback\n  ...")
        await audit.close()

    asyncio.run(run())
    upload, use, _ = read_audit(tmp_path)
    assert (upload["what"], upload["result"]) == ("upload by robot (10.0.0.5:4711)", "E401")
    assert upload["text"].endswith("active set 1 unchanged")
    assert (use["result"], use["text"]) == ("A499", "A499 internal error, please report it:")


def test_an_audit_that_was_altered_is_said_once_and_not_only_kept(tmp_path: Path) -> None:
    """It stood in the audit alone, which nobody reads before something has happened."""
    said: list[str] = []

    async def run() -> None:
        audit = RigAudit(tmp_path, lambda cause, sentence: said.append(sentence))
        audit.note_gateway("start", rig="demo")
        await audit.close()

    asyncio.run(run())
    assert said == []
    (tmp_path / "audit" / "head").unlink()
    asyncio.run(run())
    asyncio.run(run())
    assert [sentence[:4] for sentence in said] == ["A352"]


def test_what_waits_for_a_disk_is_told_with_its_end(tmp_path: Path) -> None:
    async def run() -> None:
        audit, ends = RigAudit(tmp_path, lambda cause, sentence: None), [Future[Any](), Future[Any]()]
        watched = audit.watch_handlers({"record": lambda request: ends[request["name"]]})
        watched["record"]({"do": "record", "name": 0}), watched["record"]({"do": "record", "name": 1})
        ends[1].set_exception(OSError("recordings: No space left on device"))
        ends[0].set_result({})
        await audit.close()

    asyncio.run(run())
    assert ["No space left" in json.dumps(record) for record in read_audit(tmp_path)] == [True, False, False]


def test_what_was_refused_at_this_machine_is_kept_as_that_and_refused_still(tmp_path: Path) -> None:
    refusals = {"calibration": ValueError("E436 it was rejected"), "record": OSError("the disk is full")}

    def refuse(request: dict[str, Any]) -> None:
        raise refusals[request["do"]]

    async def run() -> None:
        audit = RigAudit(tmp_path, lambda cause, sentence: None)
        for verb, handler in audit.watch_handlers(dict.fromkeys(refusals, refuse)).items():
            with pytest.raises(type(refusals[verb])):
                handler({"do": verb, "use": 1})
        await audit.close()

    asyncio.run(run())
    told = [(record["what"], record["result"]) for record in read_audit(tmp_path)][:-1]
    assert told == [(verb, str(error)) for verb, error in refusals.items()]


def test_every_verb_that_changes_something_is_kept_and_no_question_or_rehearsal(tmp_path: Path) -> None:
    verbs = ("record", "calibration", "plant", "calibrate", "sim")

    async def run() -> None:
        audit = RigAudit(tmp_path, lambda cause, sentence: None)
        watched = audit.watch_handlers(dict.fromkeys((*verbs, "health"), lambda request: {}))
        for verb in (*verbs, "health"):
            watched[verb]({"do": verb})
            watched[verb]({"do": verb, "use": 1, "dry_run": True})
            watched[verb]({"do": verb, "use": 1})
        await audit.close()

    asyncio.run(run())
    told = [(record["what"], record.get("new")) for record in read_audit(tmp_path)]
    assert told == [*((verb, '{"use": 1}') for verb in verbs), ("end", None)]


def test_a_number_that_is_none_and_what_was_only_counted_reach_the_disk(tmp_path: Path) -> None:
    """NaN is no JSON: a line with it would be refused, and all of its batch again and again."""

    async def run() -> None:
        audit = RigAudit(tmp_path, lambda cause, sentence: None)
        register_map = load_register_map("force-v1")
        bank = RegisterBank(register_map, BankRules(rig_name="demo", force_max_n=60.0), now=lambda: 0.0)
        audit.watch(bank)
        setpoint = next(one for one in register_map.registers_of("float_abcd") if one.name == "force_setpoint")
        for value in (nan, inf):
            with pytest.raises(ModbusError):
                bank.write_registers(setpoint.address, struct.pack(">f", value), ROBOT)
        for counts in range(1, 8):
            bank.write_registers(1, struct.pack(">H", counts), ROBOT)
        await audit.close()

    asyncio.run(run())
    told = [(record["what"], record.get("count"), record.get("new")) for record in read_audit(tmp_path)]
    assert told[:2] == [("write", None, None)] * 2
    assert told[-2:] == [("force_setpoint", 6, 0.07), ("end", None, None)]


def test_what_was_only_counted_is_told_when_its_time_is_over_and_not_at_the_end_alone(tmp_path: Path) -> None:
    """A gateway runs for months: the last value of a path that was driven is told a while behind it."""

    async def run() -> None:
        now = [0.0]
        audit = RigAudit(tmp_path, lambda cause, sentence: None, lambda: now[0])
        bank = RegisterBank(
            load_register_map("force-v1"), BankRules(rig_name="demo", force_max_n=60.0), now=lambda: now[0]
        )
        audit.watch(bank)
        for counts in range(1, 8):
            bank.write_registers(1, struct.pack(">H", counts), ROBOT)
        now[0] = 3600.0
        audit.flush()
        audit.note_gateway("calibration")
        await audit.close()

    asyncio.run(run())
    told = [(record["what"], record.get("count")) for record in read_audit(tmp_path)][-3:]
    assert told == [("force_setpoint", 6), ("calibration", None), ("end", None)]
