"""Sets that are not as large as the block: more stops than the registers carry, and masters of map version 1 without stops."""

from dataclasses import replace

import pytest

from gateway.bsfm import Calibration
from gateway.numbered_documents.store import StoreError
from gateway.registers.upload.coefficients import HEAD_WORDS, CoefficientSet, model_hash, set_crc
from gateway.registers.words import CommitNotice, CommitStatus, UploadReason
from tests.calibrations.coefficients import calibration, requests_of, staged
from tests.calibrations.test_upload_identity import COMMITTED, DEMO, read_back, stops
from tests.calibrations.upload_bench import COMMIT, DRY_RUN, OWN, PEER, Bench

MANY = calibration(8, number=1, **stops(12))


def test_of_a_set_with_more_stops_the_registers_show_the_number_and_what_fits(tmp_path, register_map):
    bench = Bench(tmp_path, register_map, MANY)
    shown = CoefficientSet.from_words(bench.active_words)
    assert (shown.stops, len(shown.slip_radii_v)) == (12, 10)
    assert shown.slip_shares == pytest.approx(MANY.slip_shares[:10])
    last = replace(MANY, slip_radii_v=(*MANY.slip_radii_v[:-1], 4.0))
    assert len({bench.model_hash, model_hash(last), set_crc(bench.active_words)}) == 3, (
        "the hash covers the others, too"
    )


@pytest.mark.parametrize("own_crc", [True, False])
@pytest.mark.parametrize("action", [COMMIT, DRY_RUN])
def test_a_read_back_that_lost_stops_is_refused_for_that_reason(action, own_crc, tmp_path, register_map):
    bench = Bench(tmp_path, register_map, MANY)
    read_back(bench, register_map)
    if own_crc:
        crc = set_crc(bench.active_words)
        bench.write(1142, crc >> 16, crc & 0xFFFF)
    bench.write(1145, action)
    bench.run()
    assert bench.outcome == (CommitStatus.FAILED, -1, UploadReason.STOPS_CUT)
    assert bench.log[-1] == (
        "E401 stops_cut: 12 slip stops, the registers carry 10: a read-back that has lost the others; active set 1 unchanged"
    )
    assert (bench.model_hash, bench.store.list()) == (model_hash(MANY), [])


def test_a_set_with_more_stops_is_stored_used_and_selected_all_the_same(tmp_path, register_map):
    bench = Bench(tmp_path, register_map)
    number = bench.store.add(MANY)
    bench.upload.use(number)
    bench.run()
    assert bench.used[-1].calibration == replace(MANY, number=number)
    with pytest.raises(StoreError, match="slip stops: 17 radii"):
        bench.store.add(calibration(1, **stops(17)))


def old_requests(given: Calibration, slot: int) -> list[tuple[int, bytes]]:
    """Byte for byte what such a master sends: 145 words from 1000 on, nothing above 1145."""
    return [
        (address, data)
        for address, data in requests_of(staged(CoefficientSet.of_calibration(given), length=HEAD_WORDS, slot=slot))
        if address < 1145
    ]


@pytest.mark.parametrize("action", [COMMIT, DRY_RUN])
def test_a_set_of_140_words_is_taken_as_one_without_stops_and_says_so(action, tmp_path, register_map):
    bench = Bench(tmp_path, register_map, DEMO)
    bench.write(1150, 7)  # whatever another master has left there
    for address, data in old_requests(DEMO, 5):
        bench.bank.write_registers(address, data, PEER)
    bench.write(1145, action)
    bench.run()
    assert bench.notice is CommitNotice.WITHOUT_STOPS
    assert bench.log[-1].startswith(f"W330 {'dry run' if action == DRY_RUN else 'upload'} by {PEER}: ")
    assert bench.log[-1].endswith("; length 140, as of map version 1: no slip stops, no response")
    if action == DRY_RUN:
        assert (bench.outcome, bench.model_hash) == ((CommitStatus.IDLE, 0, 0), model_hash(DEMO))
        return
    found = bench.used[-1].calibration
    assert (bench.outcome, found.number, found.name) == (COMMITTED, 2, "slot-5")
    assert (found.reversal_kind, found.response) == ("blend 14 N", None)
    assert (
        bench.model_hash
        == model_hash(replace(DEMO, slip_radii_v=(), slip_shares=(), response=None))
        != model_hash(DEMO)
    )
    assert "bsfm n=2, blend 14 N" in bench.log[-1]


def test_the_same_140_words_again_keep_their_number_and_still_say_so(tmp_path, register_map):
    bench = Bench(tmp_path, register_map, DEMO)
    for _ in range(2):
        for address, data in old_requests(DEMO, 5):
            bench.bank.write_registers(address, data, PEER)
        bench.write(1145, COMMIT)
        bench.run()
    assert (bench.upload.status()["active"], bench.notice) == (2, CommitNotice.WITHOUT_STOPS | CommitNotice.KNOWN_SET)
    assert bench.upload_of(OWN, 1) == COMMITTED
    assert bench.notice == 0, "a notice is of the last commit"
