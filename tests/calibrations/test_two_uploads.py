"""Two masters that upload at the same time, from two faces: whose set is told as committed is in use, in the slot it named."""

import struct
from itertools import combinations

import pytest

from gateway.codes.refusals import RefusalReason
from gateway.modbus import Peer, Role
from gateway.registers import Refusal
from gateway.registers.upload.coefficients import HEAD_WORDS, CoefficientSet
from gateway.registers.words import CommitStatus
from tests.calibrations.coefficients import calibration, requests_of, staged
from tests.calibrations.slots import slot_number
from tests.calibrations.upload_bench import Bench

FIRST = Peer("10.0.0.1", role=Role.CALIBRATION), calibration(16, number=0), 2
SECOND = Peer("serial:1", role=Role.CALIBRATION), calibration(24, number=0), 5
COMMIT_AT = 1145


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
