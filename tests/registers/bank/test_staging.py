"""Coefficient upload by words: stored as they come, judged at commit; the active set is read back with the same layout."""

import struct
import zlib
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from gateway.bsfm.model import Calibration
from gateway.codes.refusals import RefusalReason
from gateway.modbus import Role
from gateway.registers import Refusal, RegisterBank
from gateway.registers.upload.coefficients import HEAD_WORDS, SET_BYTES, CoefficientSet
from gateway.registers.words import CommitAction, CommitNotice, CommitStatus, UploadReason

CALIBRATION = Calibration(
    number=16,
    name="test",
    order=2,
    x0_v=0.0,
    x1_v=8.0,
    rising_handles_n=(0.0, 20.0, 60.0),
    rising_weights=(1.0, 0.5, 1.0),
    falling_handles_n=(0.0, 30.0, 60.0),
    falling_weights=(1.0, 0.5, 1.0),
    blend_span_n=3.0,
    rms_n=0.1,
    max_n=0.3,
    date_utc="2025-01-01T00:00:00Z",
    source="test",
    rig="demo",
    data_sha256="",
)


@pytest.fixture
def master(bank: RegisterBank, master_of: Callable[..., Any]) -> Any:
    return master_of(bank, "10.0.0.1", Role.CALIBRATION)


@pytest.fixture
def other(bank: RegisterBank, master_of: Callable[..., Any]) -> Any:
    return master_of(bank, "10.0.0.2", Role.CALIBRATION)


def test_single_words_are_stored_and_read_back(bank, master, register_map):
    for address, word in ((1000, 2), (1006, 0x4140), (1007, 0), (1143, 0xBEEF)):
        master.write(address, word)
    assert bank.read_registers(1006, 2) == struct.pack(">f", 12.0)
    assert master.word(1143) == 0xBEEF
    assert bank.last_writer == {"staging": (master.peer, 7.0)}


def test_staging_needs_no_ownership_and_takes_none(bank, master, other):
    master.write(0, 1, 1200)
    other.write(1000, 2)
    assert bank.owner == "10.0.0.1"


def test_every_value_fits_where_the_map_puts_it(bank, master, register_map):
    given = CoefficientSet(
        2,
        0.0,
        8.0,
        *((float(k), k + 1.0, k + 2.0) for k in (10, 20, 30, 40)),
        force_low_n=1.0,
        force_high_n=59.0,
        blend_span_n=3.0,
        stops=3,
        slip_radii_v=(0.25, 0.5, 1.5),
        slip_shares=(0.5, 0.375, 0.125),
        response_s=(0.0625, 0.125, 0.25, 0.5),
    )
    words = given.to_words()
    bank.write_registers(1000, words[:200], master.peer)
    bank.write_registers(1100, words[200:280], master.peer)
    bank.write_registers(1150, words[280:], master.peer)
    expected = {
        "order": 2,
        "range_high": 8.0,
        "rising_b_1": 11.0,
        "rising_b_3": 0.0,
        "rising_w_0": 20.0,
        "falling_b_2": 32.0,
    }
    expected |= {"falling_w_0": 40.0, "force_low": 1.0, "force_high": 59.0, "blend_span": 3.0}
    expected |= {"slip_stops": 3, "dead_time": 0.0625, "lag": 0.125, "second_lag": 0.25, "damping": 0.5}
    expected |= {
        "slip_radius_0": 0.25,
        "slip_radius_2": 1.5,
        "slip_radius_9": 0.0,
        "slip_share_1": 0.375,
        "slip_share_9": 0.0,
    }
    for name, value in expected.items():
        register = register_map.find(f"{name}@staging")
        assert register.decode(bank.read_registers(register.address, register.words)) == value, name
    found = CoefficientSet.from_words(words)
    assert (found.rising_handles_n[:3], found.slip_shares[:3]) == (given.rising_handles_n, given.slip_shares)
    assert (found.stops, found.response_s) == (3, given.response_s)


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ((1001, 1), RefusalReason.RESERVED),
        ((1140, 140, 1), RefusalReason.RESERVED),
        ((1151, 5), RefusalReason.RESERVED),
        ((1146, 3), RefusalReason.READ_ONLY),
        ((1145, 1), RefusalReason.COEFFICIENTS),
        ((1145, max(CommitAction) + 1), RefusalReason.OUT_OF_RANGE),
        ((1145, 9), RefusalReason.OUT_OF_RANGE),
        ((1144, 2, 1), RefusalReason.COEFFICIENTS),
        ((1149, 3), RefusalReason.COEFFICIENTS),
        ((1149, 8), RefusalReason.OUT_OF_RANGE),
    ],
)
def test_what_staging_refuses_leaves_no_trace(master, words, reason):
    assert master.refusal(master.write, *words).reason is reason


def test_commit_is_passed_on_with_the_staged_words_and_reads_zero(bank, master):
    seen = []
    bank.staging.on_commit = lambda action, words, peer: seen.append((action, len(words), words[288:290], peer))
    master.write(1144, 5, 1)
    assert (master.word(1144), master.word(1145)) == (5, 0)
    for word in (2, 0, 3):
        master.write(1145, word)
        assert master.word(1145) == 0
    assert [entry[0] for entry in seen] == [CommitAction.COMMIT, CommitAction.DRY_RUN, CommitAction.ROLLBACK]
    assert seen[0][1:] == (400, b"\0\5", master.peer)


def test_a_commit_that_its_server_refuses_changes_nothing(bank, master):
    def refuse(action, words, peer):
        raise Refusal(RefusalReason.BUSY, 1145, "output enabled")

    bank.staging.on_commit = refuse
    assert master.refusal(master.write, 1144, 5, 1).code == 6


def test_words_that_a_refused_commit_has_taken_back_are_those_of_who_staged_them_before(bank, master, other):
    """Else the other one could commit a set that he has not staged, and who has staged all of it could not."""
    seen = []
    bank.staging.on_commit = lambda action, words, peer: seen.append(action)
    master.write(1144, 5)
    for word in (CommitAction.COMMIT, CommitAction.DRY_RUN):
        assert other.refusal(other.write, 1145, word).reason is RefusalReason.BUSY
    other.write(1145, CommitAction.ROLLBACK)  # whoever has staged what
    bank.staging.on_commit = None
    assert other.refusal(other.write, 1144, 6, CommitAction.COMMIT).reason is RefusalReason.COEFFICIENTS
    bank.staging.on_commit = lambda action, words, peer: seen.append(action)
    master.write(1145, CommitAction.COMMIT)
    assert seen == [CommitAction.ROLLBACK, CommitAction.COMMIT]


def test_a_set_allows_what_both_of_its_branches_reach_and_limits_that_leave_a_range():
    untied = replace(CALIBRATION, falling_handles_n=(1.0, 30.0, 58.0))
    assert untied.allowed_n == (1.0, 58.0)
    with pytest.raises(ValueError, match="the highest must be above the lowest"):
        replace(CALIBRATION, force_limits_n=(20.0, 20.0)).model()


def test_a_set_without_slip_stops_is_whole_whoever_has_staged_some_before(bank, master, other):
    """Its words are those of the first stretch alone."""
    seen = []
    bank.staging.on_commit = lambda action, words, peer: seen.append(action)
    other.write(1150, 3)
    master.write(1140, HEAD_WORDS)
    master.write(1145, CommitAction.COMMIT)
    master.write(1140, HEAD_WORDS + 50)
    assert master.refusal(master.write, 1145, CommitAction.COMMIT).reason is RefusalReason.BUSY
    assert seen == [CommitAction.COMMIT]


@pytest.mark.parametrize(
    ("words", "is_taken"), [((1145, 1), False), ((1145, 3), False), ((1149, 3), False), ((1145, 2), True)]
)
def test_a_set_is_not_changed_by_what_has_waited_in_a_pile(bank, master, words, is_taken):
    """Its master may be gone, or have put another set to use since then; a dry run changes nothing."""
    seen = []
    bank.staging.on_commit = bank.staging.on_select = lambda *given: seen.append(given)
    master.peer = replace(master.peer, is_behind=True)
    if is_taken:
        master.write(*words)
    else:
        refusal = master.refusal(master.write, *words)
        assert (refusal.code, refusal.reason) == (6, RefusalReason.BUSY) and "wait for each answer" in refusal.sentence
    assert len(seen) == is_taken
    master.peer = replace(master.peer, is_behind=False)
    master.write(*words)
    assert len(seen) == 1 + is_taken


def test_staging_is_locked_while_a_commit_is_under_way(bank, master):
    for status in (CommitStatus.CHECKING, CommitStatus.WRITING):
        bank.staging.show_commit(status)
        refusal = master.refusal(master.write, 1000, 2)
        assert (refusal.code, refusal.reason) == (6, RefusalReason.BUSY)
    bank.staging.show_commit(CommitStatus.FAILED, -1, UploadReason.CRC)
    assert bank.read_registers(1146, 3) == struct.pack(">HhH", 4, -1, 21)
    master.write(1000, 2)


def test_what_a_success_does_not_say_is_in_the_notice(bank, master, register_map):
    bank.staging.show_commit(CommitStatus.COMMITTED, notice=CommitNotice.WITHOUT_STOPS)
    assert master.word(register_map.find("commit_notice").address) == CommitNotice.WITHOUT_STOPS
    bank.staging.show_commit(CommitStatus.IDLE)
    assert master.word(register_map.find("commit_notice").address) == 0


def test_who_commits_and_who_chooses_a_slot_is_told_to_the_audit(bank, master):
    told = []
    bank.staging.on_commit, bank.staging.on_select = lambda *given: None, lambda *given: None
    bank.staging.on_act = lambda *given: told.append(given)
    master.write(1145, 1), master.write(1149, 3), master.write(1145, 0)
    assert told == [("commit", "commit", master.peer), ("slot_select", "slot 3", master.peer)]


def test_a_slot_is_selected_by_its_number(bank, master, register_map):
    seen = []
    bank.staging.on_select = lambda slot, peer: seen.append((slot, peer))
    master.write(1149, 3)
    assert (seen, master.word(1149)) == ([(3, master.peer)], 3)
    master.write(1149, 7)
    with pytest.raises(Refusal, match=r"allowed 0 \.\. 7"):
        master.write(1149, 8)
    value = register_map.find("refusal_value")
    assert value.decode(bank.read_registers(value.address, value.words)) == 8
    assert (len(seen), master.word(1149)) == (2, 7)


@pytest.mark.parametrize(("address", "word"), [(1145, 4), (1145, 1), (1149, 3)])
def test_what_the_staging_block_does_not_take_is_shown_with_its_value(bank, master, address, word):
    bank.staging.on_commit = bank.staging.on_select = None
    assert master.refusal(master.write, address, word).address == address
    assert master.float(120) == word


def test_the_active_set_is_read_back_with_its_crc(bank, register_map):
    given = replace(CALIBRATION, slip_radii_v=(0.5, 1.0), slip_shares=(0.75, 0.25))
    bank.set_active_model(given, slot=4)
    words = bank.read_registers(1500, 100) + bank.read_registers(1600, 40) + bank.read_registers(1650, 50)
    assert len(words) == SET_BYTES
    assert words == CoefficientSet.of_calibration(given).to_words()
    crc = zlib.crc32(words).to_bytes(4, "big")
    assert bank.read_registers(1640, 1) == (190).to_bytes(2, "big")
    assert bank.read_registers(1642, 2) == bank.read_registers(414, 2) == crc
    assert bank.read_registers(1644, 1) == b"\0\4"
    register = register_map.find("falling_b_1@active")
    assert register.decode(bank.read_registers(register.address, 2)) == 30.0
    assert bank.read_registers(register_map.find("slip_stops@active").address, 1) == b"\0\2"


@pytest.mark.parametrize(
    ("limits_n", "shown_n"), [((), (0.0, 60.0)), ((2.0, 40.0), (2.0, 40.0)), ((-5.0, 80.0), (0.0, 60.0))]
)
def test_the_active_set_tells_the_forces_that_it_allows(bank, register_map, limits_n, shown_n):
    """Its own limits, and no more than its branches reach."""
    bank.set_active_model(replace(CALIBRATION, force_limits_n=limits_n))
    low, high = (register_map.find(f"force_{end}@active") for end in ("low", "high"))
    assert tuple(one.decode(bank.read_registers(one.address, 2)) for one in (low, high)) == shown_n


def test_sets_that_cannot_be_carried_are_said():
    with pytest.raises(ValueError, match="17 numbers in an array of at most 16"):
        CoefficientSet(16, 0.0, 1.0, (0.0,) * 17, (), (), (), 0.0, 1.0, 0.0).to_words()
    with pytest.raises(ValueError, match="4 bytes, a set has 380, or 280"):
        CoefficientSet.from_words(bytes(4))
