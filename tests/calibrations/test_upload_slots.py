"""Recipes in slots, going back, what a tool of this machine may ask for, and two masters that upload at the same time, from two
faces: whose set is told as committed is in use, in the slot it named."""

import struct
from itertools import combinations

import pytest

from gateway.codes.refusals import RefusalReason
from gateway.modbus import Peer, Role
from gateway.registers import Refusal
from gateway.registers.upload.coefficients import HEAD_WORDS, CoefficientSet
from gateway.registers.words import CommitStatus, UploadReason
from tests.calibrations.coefficients import calibration, requests_of, staged
from tests.calibrations.slots import slot_number
from tests.calibrations.upload_bench import OWN, PEER, Bench

COMMITTED = (CommitStatus.COMMITTED, 0, 0)
NO_SLOT = 0xFFFF
FIRST = Peer("10.0.0.1", role=Role.CALIBRATION), calibration(16, number=0), 2
SECOND = Peer("serial:1", role=Role.CALIBRATION), calibration(24, number=0), 5
COMMIT_AT = 1145


@pytest.fixture
def filled(bench):
    """Marks 10, 20, 30 as calibrations 2, 3, 4 in slots 1, 2, 3; the last one in use."""
    for slot in (1, 2, 3):
        assert bench.upload_of(calibration(10 * slot), slot) == COMMITTED
    return bench


def top_n(bench) -> float:
    found = bench.used[-1].calibration
    return float(found.rising_handles_n[-1])


def test_a_selected_slot_is_in_use_now_and_after_a_restart(filled):
    filled.write(1149, 1)
    assert filled.status is CommitStatus.WRITING
    filled.run()
    assert (filled.outcome, filled.active_slot, top_n(filled)) == (COMMITTED, 1, 51.25)
    assert filled.log[-1].startswith(f"slot 1 selected by {PEER}: calibration 2 (slot-1) in use, slot 1")
    again = filled.restarted()
    assert (again.active_words, again.active_slot) == (filled.active_words, 1)
    again.write(1149, 3)
    again.run()
    assert (again.active_slot, top_n(again)) == (3, 53.75)


@pytest.mark.parametrize("slot", [0, 4, 7])
def test_an_empty_slot_is_refused_at_once(filled, slot):
    before = filled.active_words
    refusal = filled.refused(1149, slot)
    assert (refusal.code, refusal.reason, refusal.address) == (3, RefusalReason.EMPTY_SLOT, 1149)
    assert refusal.sentence == f"W331 slot {slot} is empty, filled: 1, 2, 3; active set 4 unchanged"
    assert refusal.value == slot
    assert (filled.active_words, filled.work) == (before, [])


def test_a_slot_whose_file_is_damaged_fails_and_the_active_set_stays(filled):
    (filled.store.directory / "0002.yaml").write_bytes(b"")
    before = filled.active_words
    filled.write(1149, 1)
    filled.run()
    assert filled.outcome == (CommitStatus.FAILED, -1, UploadReason.NOT_STORED)
    assert filled.log[-1].startswith("E432 ") and filled.log[-1].endswith("active set 4 unchanged")
    assert filled.active_words == before
    assert filled.upload.status()["failed"]
    filled.write(1149, 2)
    filled.run()
    status = filled.upload.status()
    assert (status["failed"], status["reason"], status["slot"]) == (False, 0, 2), "of the last one, not of any"


def test_a_slot_filled_again_holds_the_new_set_and_the_old_one_is_kept_for_going_back(filled):
    filled.upload_of(calibration(40), 1)
    assert (filled.active_slot, top_n(filled), slot_number(filled.store, 1)) == (1, 55.0, 5)
    assert filled.store.load(2).rising_handles_n[-1] == 51.25
    filled.upload.rollback()
    filled.run()
    assert (filled.active_slot, top_n(filled)) == (3, 53.75)


def test_the_same_set_again_keeps_its_number_and_fills_no_disk(filled):
    for _ in range(3):
        for slot in (1, 2, 3):
            assert filled.upload_of(calibration(10 * slot), slot) == COMMITTED
    assert [entry.number for entry in filled.store.list()] == [2, 3, 4]
    filled.upload_of(calibration(10), 6)
    assert (slot_number(filled.store, 6), filled.active_slot) == (2, 6)
    filled.upload_of(calibration(50), 3)
    assert slot_number(filled.store, 3) == 5


def test_a_slot_may_hold_the_built_in_set_under_its_own_number(filled):
    assert filled.upload_of(OWN, 6) == COMMITTED
    assert (slot_number(filled.store, 6), filled.active_slot, filled.used[-1].calibration) == (1, 6, OWN)
    assert filled.upload.status()["built_in"]
    filled.write(1149, 3)
    filled.run()
    for again in (filled, filled.restarted()):
        again.write(1149, 6)
        again.run()
        assert (again.outcome, again.active_slot, again.used[-1].calibration) == (COMMITTED, 6, OWN)
        assert again.restarted().active_slot == 6
    assert [entry.number for entry in filled.store.list()] == [2, 3, 4]
    filled.upload_of(calibration(40), 6)
    filled.upload.rollback()
    filled.run()
    assert (filled.active_slot, filled.used[-1].calibration) == (NO_SLOT, OWN), "slot 6 holds another one now"


def test_a_slot_with_the_built_in_set_means_what_the_rig_says_and_never_a_number_of_the_store(bench, register_map):
    """The rig's file may name another calibration one day, even one with a number that the store has."""
    bench.upload_of(calibration(10), 1)
    bench.upload_of(OWN, 2)
    other = Bench(bench.state, register_map, calibration(77, number=2))
    other.write(1149, 2)
    other.run()
    assert other.used[-1].calibration == calibration(77, number=2)


def test_going_back_twice_goes_forth_again(filled):
    for expected in (53.75 - 1.25, 53.75, 53.75 - 1.25):
        answer = filled.upload.rollback()
        assert answer["busy"]
        filled.run()
        assert top_n(filled) == expected
    assert filled.restarted().active_words == filled.active_words


def test_how_a_change_went_is_known_behind_another_ones_and_of_the_last_eight(bench):
    """Who asks how its rollback went was told of the change of another one that had ended behind it."""
    job = bench.upload.rollback()["job"]
    bench.run()
    own = bench.upload.status()["said"]
    for others in range(1, 10):
        bench.upload.use(1)
        bench.run()
        assert bench.upload.status()["ends"].get(str(job), {}).get("said") == (own if others < 8 else None)
    assert own.startswith("E433 ") and len(bench.upload.status()["ends"]) == 8


def test_going_back_from_the_first_upload_leads_to_the_rigs_own(bench):
    bench.upload_of(calibration(10), 1)
    bench.upload.rollback()
    bench.run()
    assert (bench.used[-1].calibration, bench.active_slot) == (OWN, NO_SLOT)
    assert bench.upload.status()["built_in"]


def test_going_back_from_nowhere_says_so(bench):
    bench.upload.rollback()
    bench.run()
    status = bench.upload.status()
    assert status["failed"]
    assert status["said"] == (
        "E433 no calibration was in use before this one: there is nothing to go back to; active set 1 unchanged"
    )


def test_a_tool_uses_a_calibration_by_its_number(filled):
    job = filled.upload.use(2)["job"]
    filled.run()
    status = filled.upload.status()
    assert (status["job"], status["busy"], status["failed"]) == (job, False, False)
    assert (status["active"], status["slot"], filled.active_slot) == (2, None, NO_SLOT)
    filled.upload.use(99)
    filled.run()
    assert filled.upload.status()["failed"]
    assert "there is no calibration 99" in filled.upload.status()["said"]
    assert filled.upload.status()["active"] == 2


def test_a_calibration_beyond_the_rigs_cell_is_not_used_and_not_started_with(filled):
    wide = calibration(4, rising_handles_n=(0.0, 25.0, 120.0), falling_handles_n=(0.0, 60.0, 120.0))
    number = filled.store.add(wide)
    filled.upload.use(number)
    filled.run()
    assert filled.upload.status()["said"].startswith("E401 index 2, handle_range: ")
    filled.store.use(number)
    again = filled.restarted()
    assert again.active_words == filled.active_words
    assert "E401 calibration 5" in again.selected.notes[0]


def test_a_master_goes_back_to_what_was_in_use_before(filled):
    before = filled.active_words
    filled.write(1149, 1)
    filled.run()
    filled.write(1145, 3)
    assert filled.status is CommitStatus.WRITING
    filled.run()
    assert filled.outcome == COMMITTED
    assert (filled.active_words, filled.active_slot) == (before, 3)
    assert filled.restarted().active_words == before


def test_what_comes_beside_a_job_of_this_machine_is_refused_at_its_own_register(filled, register_map):
    """Staging is open then: nothing of a master's is under way. Each job has a number of its own."""
    commit = register_map.find("commit").address
    jobs = [filled.upload.use(2)["job"]]
    for address, word in ((1149, 1), (commit, 1)):
        refusal = filled.refused(address, word)
        assert (refusal.reason, refusal.address) == (RefusalReason.BUSY, address)
        assert "calibration use 2 is under way" in refusal.sentence
    filled.run()
    jobs.append(filled.upload.use(3)["job"])
    filled.run()
    assert jobs[1] == jobs[0] + 1 and filled.upload.status()["job"] == jobs[1]


def _requests(master: tuple[Peer, object, int], most: int) -> list[tuple[int, bytes]]:
    _, given, slot = master
    words = staged(CoefficientSet.of_calibration(given), slot=slot)  # type: ignore[arg-type]
    return [*requests_of(words, most), (COMMIT_AT, struct.pack(">H", 1))]


@pytest.mark.parametrize("most", [123, 60])
def test_of_two_uploads_that_interleave_none_commits_what_the_other_has_staged(bench: Bench, most: int) -> None:
    """The set of one was put into the slot of the other, and into use, or the other's own in its place, told as committed."""
    requests = [_requests(master, most) for master in (FIRST, SECOND)]
    count, refused = len(requests[0]) + len(requests[1]), 0
    for places in combinations(range(count), len(requests[0])):
        left = [list(each) for each in requests]
        for place in range(count):
            which = 0 if place in places else 1
            (peer, given, slot), (address, data) = (FIRST, SECOND)[which], left[which].pop(0)
            try:
                bench.bank.write_registers(address, data, peer)
            except Refusal as refusal:
                assert (refusal.reason, address) == (RefusalReason.BUSY, COMMIT_AT)
                refused += 1
                continue
            bench.run()
            if address == COMMIT_AT and bench.status is CommitStatus.COMMITTED:
                assert bench.active_slot == slot and slot_number(bench.store, slot) == bench.used[-1].calibration.number
                assert bench.used[-1].calibration.rising_handles_n == given.rising_handles_n
    assert refused


def test_a_shorter_set_is_committed_whatever_another_master_has_left_behind_it(bench: Bench) -> None:
    """It has no stops: who sends it knows of no words there, and could not stage them anew."""
    bench.bank.write_registers(1150, struct.pack(">H", 7), SECOND[0])
    words = staged(CoefficientSet.of_calibration(FIRST[1]), length=HEAD_WORDS, slot=FIRST[2])
    for address, part in requests_of(words):
        if address < 1145:
            bench.bank.write_registers(address, part, FIRST[0])
    bench.write(COMMIT_AT, 1)
    bench.run()
    assert bench.status is CommitStatus.COMMITTED
    bench.bank.write_registers(1144, struct.pack(">H", 5), SECOND[0])
    refusal = bench.refused(COMMIT_AT, 1)
    assert refusal.reason is RefusalReason.BUSY and "serial:1" in refusal.sentence
    bench.write(1144, FIRST[2])
    bench.write(COMMIT_AT, 1)
    bench.run()
    assert bench.status is CommitStatus.COMMITTED and bench.active_slot == FIRST[2]


def test_a_commit_that_is_refused_leaves_the_words_to_who_has_staged_them(bench: Bench) -> None:
    for address, part in requests_of(staged(CoefficientSet.of_calibration(FIRST[1]), slot=FIRST[2])):
        bench.bank.write_registers(address, part, FIRST[0])
    with pytest.raises(Refusal) as refused:
        bench.bank.write_registers(COMMIT_AT - 1, struct.pack(">2H", SECOND[2], 1), SECOND[0])
    assert refused.value.reason is RefusalReason.BUSY
    bench.bank.write_registers(COMMIT_AT, struct.pack(">H", 1), FIRST[0])
    bench.run()
    assert bench.status is CommitStatus.COMMITTED and bench.active_slot == FIRST[2]


def test_a_tool_is_told_the_reason_of_the_job_that_failed_and_none_behind_one_that_did_not(bench: Bench) -> None:
    """Its exit code says by that whether the disk or the calibration is to blame."""
    bench.upload.use(77)
    bench.run()
    assert (bench.upload.status()["failed"], bench.upload.status()["reason"]) == (True, UploadReason.NOT_STORED)
    bench.upload_of(calibration(16))
    assert (bench.upload.status()["failed"], bench.upload.status()["reason"]) == (False, 0)
