"""What the audit keeps of a bank's writes: every edge, every refusal, and setpoints in few lines."""

import struct
from typing import Any

import pytest

from gateway.audit.write_audit import MOST_SERIES, WriteAudit
from gateway.modbus import ModbusError, Peer, Role, answer
from gateway.modbus.pdu import is_exception
from gateway.modbus.server import refuse_unit
from gateway.profiles import load_register_map
from gateway.registers import BankRules, RegisterBank
from gateway.registers.command import Status
from gateway.registers.words import ControlBit, State

ROBOT, OTHER = Peer("10.0.0.5", 4711, "robot", Role.SETPOINT), Peer("10.0.0.6", 4712)


class Watched:
    """A bank under audit, in virtual time."""

    def __init__(self, **rules: Any) -> None:
        self.now_s = 0.0
        self.kept: list[dict[str, Any]] = []
        self.bank = RegisterBank(
            load_register_map("force-v1"), BankRules(rig_name="demo", force_max_n=60.0, **rules), now=self.clock
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


@pytest.mark.parametrize(
    ("pdu", "where", "code", "new"),
    [
        (b"\x05\x00\x00\x12\x34", 0, "W204", 0x1234),
        (b"\x05\x00\x63\x12\x34", 99, "W202", None),
        (b"\x10\x00\x01\x00\x02\x03\x00\x00\x00", 1, "W220", None),
        (b"\x06\x00\x01", 1, "W220", None),
        (b"\x17\x03\xe7\x00\x02\x00\x01\x00\x01\x02\x04\xb0", 999, "W202", None),
    ],
    ids=[
        "FC05 with neither 0 nor 1",
        "FC05 nowhere with neither",
        "FC16 with another count",
        "FC06 cut off",
        "FC23 that reads nowhere",
    ],
)
def test_a_write_that_the_protocol_s_own_rules_refuse_is_kept_too(
    watched: Watched, pdu: bytes, where: int, code: str, new: float | None
) -> None:
    """Every refused write is; those stood in the log alone, which is not kept for years."""
    assert is_exception(answer(pdu, watched.bank, OTHER))
    assert watched.told("what", "address", "result", "new") == [("write", where, code, new)]
    assert is_exception(answer(b"\x03\x03\xe7\x00\x02", watched.bank, OTHER))
    assert len(watched.kept) == 1, "a read is none"
    refuse_unit((9, pdu), (1,), watched.bank, OTHER)
    refuse_unit((9, b"\x03\x00\x00\x00\x02"), (1,), watched.bank, OTHER)
    assert watched.told("result")[1:] == [("W222",)]


def test_a_stop_of_a_run_that_this_machine_has_begun_is_kept_although_no_bit_falls(watched: Watched) -> None:
    watched.write(OTHER, 0, 0)
    assert watched.kept == []
    watched.bank.publish(Status(state=State.CALIBRATING))
    watched.write(OTHER, 0, 0)
    assert watched.told("peer", "what", "result") == [("10.0.0.6:4712", "stop", "accepted")]


def test_a_run_that_ends_within_a_heartbeat_is_no_change_of_owner_by_it(watched: Watched) -> None:
    """Control decides at each write. Stopped by a person at the machine a moment ago, a run let its master go."""
    watched.write(ROBOT, 0, 0, 1200)
    watched.kept.clear()
    watched.bank.on_command = lambda command: watched.bank.clear_command()
    watched.write(ROBOT, 4, 7)
    assert watched.bank.owner is None and watched.kept == []


def test_a_bit_that_falls_is_named_by_what_its_fall_does() -> None:
    """Who reads that a calibration was started twice looks for a second one."""
    watched = Watched(supported_bits=ControlBit(127))
    for word in (32, 0, 1, 0):
        watched.write(ROBOT, 0, word)
    told = [(what, new) for what, new in watched.told("what", "new") if what != "owner"]
    assert told == [("start_calibration", 1.0), ("stop_calibration", 0.0), ("enable", 1.0), ("disable", 0.0)]


@pytest.mark.parametrize(("note", "length"), [(380, 392), (600, 404)])
def test_a_request_of_the_control_socket_is_kept_whole_up_to_400_characters(
    watched: Watched, note: int, length: int
) -> None:
    watched.audit.note_local("record", {"do": "record", "note": "x" * note}, "accepted")
    ((asked,),) = watched.told("new")
    assert len(asked) == length and asked.endswith(" ..." if note > 400 else '"}')


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
    for k in (*range(50), -5, 30):
        watched.write(ROBOT, 1, 1000 + k)
    watched.write(ROBOT, 0, 0)
    assert [what for (what,) in watched.told("what")][-3:] == ["force_setpoint", "disable", "owner"]
    (summary,) = [record for record in watched.kept if "count" in record]
    assert (summary["count"], summary["old"], summary["new"]) == (49 + 2, 10.00, 10.30)
    assert (summary["min"], summary["max"]) == (9.95, 10.49)


def test_summaries_come_before_an_edge_also_where_another_of_the_same_write_is_only_counted(watched: Watched) -> None:
    """A program that holds tare at 1: the enable beside its thirtieth is told, and what led to it before that."""
    for _ in range(30):
        watched.write(ROBOT, 0, 4)
    for setpoint in (1000, 1100, 1200):
        watched.write(ROBOT, 1, setpoint)
    watched.write(ROBOT, 0, 5)
    told = watched.told("what", "new")
    assert told.index(("force_setpoint", 12.0)) < told.index(("enable", 1.0))


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


def test_a_window_is_told_when_it_ends_and_each_is_twice_as_long_up_to_ten_minutes(watched: Watched) -> None:
    """However long after the start it began; one in which nothing came ends the series, and the next write is a first one."""
    watched.now_s = 5000.0
    watched.write(ROBOT, 1, 1000)
    for k, window_s in enumerate((10.0, 20.0, 40.0, 80.0, 160.0, 320.0, 600.0, 600.0)):
        watched.write(ROBOT, 1, 1100 + k)
        for share, count in ((0.9, 0), (1.0, 1)):
            watched.kept.clear()
            end_s = 5000.0 + sum((10.0 * 2**j if j < 6 else 600.0) for j in range(k))
            watched.now_s = end_s + share * window_s
            watched.audit.flush()
            assert watched.told("count", "seconds") == [(1, window_s)] * count, (k, share)
    watched.now_s += 600.0
    watched.audit.flush()
    watched.now_s += 1.0
    watched.write(ROBOT, 1, 1000)
    assert watched.told("what", "new", "count")[1:] == [("force_setpoint", 10.0, None)]


def test_two_reasons_of_one_peer_are_counted_apart_and_each_ends_with_its_last_sentence(watched: Watched) -> None:
    for k in range(20):
        watched.write(ROBOT, 1, 7000 + k)
        watched.write(ROBOT, 100, k)
    watched.audit.close()
    told = [(record["result"], record["count"], record["text"]) for record in watched.kept if "count" in record]
    assert [(result, count) for result, count, _ in told] == [("W204", 15), ("W205", 15)]
    assert "70.19 N" in told[0][2]


def test_an_edge_ends_the_summaries_of_its_own_peer_only(watched: Watched) -> None:
    watched.write(ROBOT, 0, 1, 1000)
    for k in range(5):
        watched.write(ROBOT, 1, 1000 + k)
    watched.write(OTHER, 0, 0)
    assert ("10.0.0.6:4712", "disable") in watched.told("peer", "what")
    assert not [record for record in watched.kept if "count" in record]


def test_a_change_of_the_owner_is_kept_where_no_bit_changes(watched: Watched) -> None:
    watched.write(ROBOT, 1, 1000)
    assert watched.told("what", "old", "new") == [("owner", None, "certificate robot"), ("force_setpoint", 0.0, 10.0)]


def test_many_peers_do_not_fill_the_memory(watched: Watched) -> None:
    for k in range(3000):
        watched.write(Peer(f"fe80::{k:x}", 1, role=Role.MONITOR), 1, 100)
    assert len(watched.kept) == 3000
    assert len(watched.audit._series) <= 1000


def test_what_was_only_counted_is_told_when_too_many_kinds_of_writes_come(watched: Watched) -> None:
    """Of a thousand strangers none may have a robot's setpoints forgotten."""
    robot = Peer("10.0.0.1", 4000)
    for setpoint in (1200, 1300, 1400, 1500):
        watched.write(robot, 1, setpoint)
    for k in range(MOST_SERIES):
        watched.write(Peer(f"10.1.{k // 250}.{k % 250}", 4000), 1, 900)
    (counted,) = [one for one in watched.kept if one.get("count")]
    assert (counted["what"], counted["count"], counted["old"], counted["new"]) == ("force_setpoint", 3, 12.0, 15.0)
