"""A staged set is in use, durable and read back as it was sent, or nothing has changed and the master reads why."""

import struct
from dataclasses import replace
from itertools import count
from random import Random

import pytest

from gateway.bsfm import CoefficientReason, Response
from gateway.bsfm.slip.slip_stops import STOPS_MAX
from gateway.calibrations.store import UNKNOWN_N
from gateway.codes.refusals import RefusalReason
from gateway.registers.upload.coefficients import HEAD_WORDS, CoefficientSet, model_hash, words_of_block
from gateway.registers.words import CommitNotice, CommitStatus, UploadReason
from tests.calibrations.coefficients import calibration, staged, swapped
from tests.calibrations.failing_disk import disk
from tests.calibrations.slots import slot_number
from tests.calibrations.upload_bench import COMMIT, DRY_RUN, OWN, PEER

GOOD = CoefficientSet.of_calibration(calibration(16))
SLIP = CoefficientSet.of_calibration(
    calibration(
        16, slip_radii_v=(0.25, 0.5, 1.0), slip_shares=(0.25, 0.5, 0.25), response=Response(dead_time_s=0.08, lag_s=0.1)
    )
)
NOTHING, COMMITTED, FAILED = (CommitStatus.IDLE, 0, 0), (CommitStatus.COMMITTED, 0, 0), CommitStatus.FAILED
NO_SLOT = 0xFFFF


def changed(**changes: object) -> CoefficientSet:
    return replace(GOOD, **changes)


def slipping(**changes: object) -> bytes:
    return staged(replace(SLIP, **changes))


def test_a_committed_set_is_in_use_and_reads_back_as_sent(bench):
    words = staged(GOOD, slot=3)
    assert bench.commit(words) == COMMITTED
    assert bench.active_words == words_of_block(words)
    assert bench.bank.read_registers(1642, 2) == words[284:288], "the CRC of the active set is the CRC that was sent"
    assert bench.active_slot == 3
    (taken,) = bench.used
    assert bench.shown == [CommitStatus.WRITING], "committed is not said before the set is in use"
    assert taken.calibration.number == 2
    assert taken.model.voltage_v(26.0, 1.0)[0] == pytest.approx(4.0)
    assert bench.log == [f"upload by {PEER}: calibration 2 (slot-3) in use, slot 3: psfm n=2, blend 5 N, 0.0 .. 52.0 N"]


def test_what_an_upload_does_not_tell_is_not_made_up(bench):
    bench.commit(staged(GOOD, slot=3))
    stored = bench.store.load(2)
    assert (stored.rms_n, stored.max_n) == (UNKNOWN_N, UNKNOWN_N)
    assert (stored.date_utc, stored.rig) == ("2026-11-22", "demo")
    assert stored.source == "upload over Modbus by 10.0.0.1"
    assert len(stored.data_sha256) == 64


@pytest.mark.sampled
@pytest.mark.parametrize("order", range(1, 16))
def test_every_order_is_carried_and_starts_again_after_a_restart(bench, order):
    rng = Random(order)
    weights = (1.0, *(rng.uniform(0.5, 2.0) for _ in range(order)))
    given = calibration(order, order=order, rising_weights=weights, falling_weights=weights)
    words = staged(CoefficientSet.of_calibration(given), slot=order % 8)
    assert bench.commit(words) == COMMITTED
    again = bench.restarted()
    assert again.active_words == bench.active_words == words_of_block(words)
    assert again.active_slot == order % 8


def test_single_words_are_enough_for_a_master_that_has_only_fc06(bench):
    words = staged(CoefficientSet.of_calibration(calibration(3, order=15)), slot=1)
    order = list(range(0, len(words), 2))
    Random(4).shuffle(order)
    for at in (at for at in order if not 290 <= at < 300):
        bench.write(1000 + at // 2, int.from_bytes(words[at : at + 2], "big"))
    bench.write(1145, COMMIT)
    bench.run()
    assert bench.outcome == COMMITTED
    assert bench.active_words == words_of_block(words)


@pytest.mark.parametrize("most", [1, 2, 7, 64, 100, 123])
def test_it_does_not_matter_how_the_writes_are_split(bench, most):
    words = staged(GOOD)
    bench.stage(words, most)
    bench.write(1145, COMMIT)
    bench.run()
    assert bench.outcome == COMMITTED


def test_the_last_part_and_the_commit_may_travel_together(bench):
    words = staged(GOOD, slot=5)
    bench.stage(words[:280] + bytes(20) + words[300:])
    bench.write(1140, *(int.from_bytes(words[at : at + 2], "big") for at in range(280, 290, 2)), COMMIT)
    bench.run()
    assert bench.outcome == COMMITTED
    assert bench.active_slot == 5


SCALARS = (("x0_v", 0.5), ("x1_v", 8.0), ("blend_span_n", 3.0), ("force_low_n", 0.7), ("force_high_n", 40.0))
CHECKS = [
    (staged(GOOD, length=139), -1, UploadReason.LENGTH),
    (staged(GOOD, crc=1), -1, UploadReason.CRC),
    (staged(GOOD, slot=8), -1, UploadReason.TARGET_SLOT),
    (staged(changed(order=0)), -1, CoefficientReason.ORDER),
    (staged(changed(order=16)), -1, CoefficientReason.ORDER),
    (staged(changed(order=1)), 2, UploadReason.UNUSED_NOT_ZERO),
    (staged(changed(falling_handles_n=(0.0, 28.0, 52.0, 1.0))), 35, UploadReason.UNUSED_NOT_ZERO),
    (staged(changed(rising_handles_n=(0.0, float("nan"), 52.0))), 1, CoefficientReason.NOT_FINITE),
    (staged(changed(falling_weights=(1.0, 1.0, float("inf")))), 50, CoefficientReason.NOT_FINITE),
    (staged(changed(rising_handles_n=(0.0, 26.0, 101.0))), 2, CoefficientReason.HANDLE_RANGE),
    (staged(changed(falling_handles_n=(-101.0, 28.0, 52.0))), 32, CoefficientReason.HANDLE_RANGE),
    (staged(changed(rising_weights=(1.0, 0.0, 1.0))), 17, CoefficientReason.WEIGHT_RANGE),
    (staged(changed(rising_weights=(1.0, -1.0, 1.0))), 17, CoefficientReason.WEIGHT_RANGE),
    (staged(changed(falling_weights=(1.0, 1.0, 2000.0))), 50, CoefficientReason.WEIGHT_RANGE),
    (staged(changed(rising_weights=(1.0, 2.2779e-41, 1.0))), 17, CoefficientReason.WORDS_SWAPPED),
    (staged(changed(rising_handles_n=(0.0, 60.0, 52.0))), 0, CoefficientReason.NOT_INCREASING),
    (staged(changed(falling_handles_n=(0.0, -20.0, 52.0))), 32, CoefficientReason.NOT_INCREASING),
    (staged(changed(rising_handles_n=(0.0, 0.5, 52.0))), 0, CoefficientReason.SLOPE_FLOOR),
    (staged(changed(rising_handles_n=(0.0, 30.0, 52.0))), -1, CoefficientReason.CROSSING),
    (staged(changed(x0_v=8.0)), -1, CoefficientReason.VOLTAGE_RANGE),
    (staged(changed(x1_v=12.0)), -1, CoefficientReason.VOLTAGE_RANGE),
    (staged(changed(blend_span_n=-1.0)), -1, CoefficientReason.BLEND_SPAN),
    *((staged(changed(**{name: swapped(meant)})), -1, CoefficientReason.WORDS_SWAPPED) for name, meant in SCALARS),
    (staged(changed(force_high_n=53.0)), -1, UploadReason.FORCE_LIMITS),
    (staged(changed(force_low_n=-1.0)), -1, UploadReason.FORCE_LIMITS),
    (bytes(400), -1, UploadReason.LENGTH),
    (slipping(stops=12), -1, UploadReason.STOPS_CUT),
    (slipping(stops=STOPS_MAX), -1, UploadReason.STOPS_CUT),
    (slipping(stops=STOPS_MAX + 1), -1, CoefficientReason.SLIP_STOPS),
    (slipping(stops=2), 66, UploadReason.UNUSED_NOT_ZERO),
    (slipping(slip_shares=(0.25, 0.5, 0.25, 0.125)), 83, UploadReason.UNUSED_NOT_ZERO),
    (slipping(slip_radii_v=(0.25, 0.25, 1.0)), 65, CoefficientReason.SLIP_RADIUS),
    (slipping(slip_radii_v=(0.0, 0.5, 1.0)), 64, CoefficientReason.SLIP_RADIUS),
    (slipping(slip_radii_v=(-0.25, 0.5, 1.0)), 64, CoefficientReason.SLIP_RADIUS),
    (slipping(slip_radii_v=(0.25, 0.5, 1e9)), 66, CoefficientReason.SLIP_RADIUS),
    (slipping(slip_radii_v=(0.25, float("inf"), 1.0)), 65, CoefficientReason.NOT_FINITE),
    (slipping(slip_radii_v=(0.25, swapped(0.5), 1.0)), 65, CoefficientReason.WORDS_SWAPPED),
    (slipping(slip_shares=(0.25, float("nan"), 0.25)), 81, CoefficientReason.NOT_FINITE),
    (slipping(slip_shares=(-0.25, 1.0, 0.25)), 80, CoefficientReason.SLIP_SHARE),
    (slipping(slip_shares=(0.25, 0.5, 0.2501)), 80, CoefficientReason.SLIP_SHARE),
    (slipping(slip_shares=(swapped(0.25), 0.5, 0.25)), 80, CoefficientReason.WORDS_SWAPPED),
    (slipping(slip_radii_v=(0.001, 0.5, 1.0)), 64, CoefficientReason.SLIP_STIFFNESS),
    (slipping(response_s=(1.5, 0.1, 0.0, 0.0)), 96, CoefficientReason.RESPONSE),
    (slipping(response_s=(0.0, -0.1, 0.0, 0.0)), 97, CoefficientReason.RESPONSE),
    (slipping(response_s=(0.0, 0.1, 2.5, 0.0)), 98, CoefficientReason.RESPONSE),
    (slipping(response_s=(0.0, 0.1, 0.1, 1.5)), 99, CoefficientReason.RESPONSE),
    (slipping(response_s=(0.0, 0.1, 0.1, 0.01)), 99, CoefficientReason.RESPONSE),
    (slipping(response_s=(0.0, 0.1, 0.0, 0.5)), 99, CoefficientReason.RESPONSE),
    (slipping(response_s=(float("nan"), 0.1, 0.0, 0.0)), 96, CoefficientReason.NOT_FINITE),
    (slipping(response_s=(swapped(0.08), 0.1, 0.0, 0.0)), 96, CoefficientReason.WORDS_SWAPPED),
]


@pytest.mark.sampled
@pytest.mark.parametrize("action", [COMMIT, DRY_RUN])
@pytest.mark.parametrize(("words", "index", "reason"), CHECKS, ids=lambda value: getattr(value, "name", ""))
def test_a_set_that_fails_a_check_changes_nothing_and_says_where_and_why(bench, words, index, reason, action):
    before = bench.active_words
    assert bench.commit(words, action) == (FAILED, index, reason)
    assert bench.active_words == before
    assert (bench.used, bench.store.list(), bench.store.find_selected().document) == ([], [], OWN)
    (sentence,) = bench.log
    assert bench.failed == [(f"{'upload' if action == COMMIT else 'dry run'} by {PEER}", sentence)]
    assert sentence.startswith("E401 ")
    assert reason.name.lower() in sentence
    assert sentence.endswith("active set 1 unchanged")
    assert (bench.notice, bench.model_hash) == (CommitNotice(0), model_hash(OWN))
    assert (f"index {index}" in sentence) == (index >= 0)
    assert bench.commit(staged(GOOD)) == COMMITTED, "and the next good set passes"


def test_every_reason_is_among_those_tried():
    tried = {reason for _, _, reason in CHECKS}
    not_of_a_set = {UploadReason.STORAGE, UploadReason.NOT_STORED, UploadReason.DEFECT}
    assert {*CoefficientReason, *UploadReason} - {CoefficientReason.NONE} - not_of_a_set == tried


def test_a_dry_run_checks_all_and_stores_nothing(bench):
    before = bench.active_words
    assert bench.commit(staged(GOOD), DRY_RUN) == NOTHING
    assert bench.active_words == before
    assert (bench.used, bench.store.list()) == ([], [])
    assert bench.log == [f"dry run by {PEER}: the set would be accepted"] and not bench.failed


# -- while it is under way


def test_a_commit_is_answered_at_once_and_staging_is_busy_until_it_has_ended(bench):
    bench.stage(staged(GOOD))
    bench.write(1145, COMMIT)
    seen = []
    while bench.work:
        seen.append(bench.status)
        for words in ((1000, 2), (1145, COMMIT), (1149, 0)):
            refusal = bench.refused(*words)
            assert (refusal.code, refusal.reason) == (6, RefusalReason.BUSY)
        with pytest.raises(ValueError, match=r"upload by .* is under way"):
            bench.upload.use(1)
        assert bench.upload.status()["busy"]
        bench.run(1)
    assert seen == [CommitStatus.CHECKING, CommitStatus.WRITING]
    assert bench.outcome == COMMITTED
    bench.write(1000, 2)


def test_committed_is_said_after_the_last_fsync_of_the_directory(bench):
    seen = []
    with disk() as there:
        there.before_fsync = lambda name: seen.append((name, bench.status))
        bench.upload_of(calibration(16))
    assert {status for _, status in seen} == {CommitStatus.WRITING}
    assert [name for name, _ in seen][-2:] == ["active.000001.new", "calibrations"]
    assert bench.outcome == COMMITTED


def test_while_a_tool_changes_the_calibration_commits_are_refused_and_the_registers_keep_quiet(bench):
    bench.upload_of(calibration(16))
    bench.write(1000, 2)
    bench.upload.use(1)
    assert bench.outcome == COMMITTED
    bench.write(1000, 2)
    for words in ((1145, COMMIT), (1149, 0)):
        assert bench.refused(*words).code == 6
    bench.run()
    assert bench.active_words == CoefficientSet.of_calibration(OWN).to_words()
    bench.upload.use(99)
    bench.run()
    assert "99" in bench.log[-1] and bench.outcome == COMMITTED, "its failure is none of the master's"


@pytest.mark.parametrize("slot", [0, 4])
def test_whatever_call_of_the_disk_fails_the_active_set_stays(bench, slot):
    bench.upload_of(calibration(8), 0)
    for n in count(1):
        before, number = bench.active_words, bench.upload.status()["active"]
        with disk(n) as there:
            outcome = bench.upload_of(calibration(n), slot)
        if outcome == COMMITTED:
            assert bench.active_words != before
        else:
            assert outcome == (FAILED, -1, UploadReason.STORAGE)
            assert bench.log[-1].startswith("E431 calibration not stored: No space left on device")
            assert bench.log[-1].endswith(f"active set {number} unchanged")
            assert bench.active_words == before
        assert bench.restarted().active_words == bench.active_words
        if len(there.calls) < n:
            break
    assert n > 10


def test_what_is_told_of_a_success_is_not_told_of_a_failure(bench):
    short = staged(GOOD, length=HEAD_WORDS)
    with disk(1, lasting=True):
        assert bench.commit(short) == (FAILED, -1, UploadReason.STORAGE)
    assert bench.notice == CommitNotice(0), "nothing is in use without slip stops"
    assert bench.commit(short) == COMMITTED
    assert bench.notice == CommitNotice.WITHOUT_STOPS


def test_a_defect_of_ours_ends_the_commit_and_nothing_else(bench, monkeypatch):
    monkeypatch.setattr(bench.store, "add", lambda given: {}["missing"])
    assert bench.upload_of(calibration(16)) == (FAILED, -1, UploadReason.DEFECT)
    assert bench.log[-1].startswith("A499 internal error, please report it; active set 1 unchanged:\n")
    assert "KeyError: 'missing'" in bench.log[-1]
    monkeypatch.undo()
    assert bench.upload_of(calibration(16)) == COMMITTED


def test_force_limits_stay_with_their_set_and_the_smaller_of_them_and_the_rigs_holds(bench):
    narrow = replace(calibration(16), force_limits_n=(2.5, 25.3))
    assert bench.upload_of(narrow, 3) == COMMITTED
    for given in (bench, bench.restarted()):
        assert given.bank.read_registers(1634, 4) == struct.pack(">2f", 2.5, 25.3)
        for word, force_n in ((2531, "25.31"), (249, "2.49")):
            told = f"W204 force_setpoint = {force_n} N, allowed 0 and 2.5 .. 25.3 N (calibration 2)"
            assert given.refused(1, word).sentence.startswith(told)
        given.write(1, 2530)
        given.write(1, 250)
        given.write(1, 0)
    assert bench.used[-1].model.limits_n == (2.5, 25.3)
    assert bench.upload_of(narrow, 4) == COMMITTED
    assert slot_number(bench.store, 4) == 2, "the very same set"
    assert bench.upload_of(calibration(16), 4) == COMMITTED
    assert slot_number(bench.store, 4) == 3, "without the limits it is another one"
    bench.write(1, 6000)
    assert bench.refused(1, 6001).sentence.startswith("W204 force_setpoint = 60.01 N, allowed 0 .. 60 N (rig demo)")


def test_a_gateway_without_any_calibration_is_a_defect(bench):
    with pytest.raises(ValueError, match="has a calibration"):
        type(bench.upload)(
            bench.bank.staging, bench.upload._activation, replace(bench.selected, document=None), None, print
        )
