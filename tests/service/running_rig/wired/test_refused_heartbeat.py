"""A master that writes its whole block in each cycle, and asks a force that is refused: what it sees, and what it is told."""

import pytest

from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.modbus import Peer
from gateway.registers import Refusal
from gateway.registers.words import State
from tests.service.rigs import strict, with_supervision
from tests.service.wired import ENABLE, MASTER, Wired

BEAT_S = 0.05
BEYOND = 9000  # 90.00 N


def test_a_heartbeat_in_a_refused_block_is_none_and_the_fault_tells_where_to_look() -> None:
    """One snapshot, taken whole or not at all; A310 spoke of a program that stopped, and its own ran on."""
    wired = Wired(with_supervision(strict(), lease_s=0.2)).ready()
    for beat in range(1, 20):
        wired.write(0, ENABLE, 1500, 0, 0, beat)
        wired.run(BEAT_S)
    assert wired.state is State.HOLDING
    for beat in range(20, 26):
        with pytest.raises(Refusal, match=r"force_setpoint = 90\.00 N, allowed 0"):
            wired.write(0, ENABLE, BEYOND, 0, 0, beat)
        assert (wired.word("refusal_address"), wired.word("refusal_reason")) == (1, RefusalReason.OUT_OF_RANGE)
        wired.run(BEAT_S)
    assert wired.fault_code is FaultCode.MASTER_LOST
    (told,) = (sentence for _, sentence in wired.log if sentence.startswith("A310 "))
    assert "its last write was refused, with any heartbeat in it (W204 force_setpoint = 90.00 N, allowed 0 .. " in told
    explanation = wired.fault_code.explanation
    assert "refused" in explanation.probably and "refusal_reason" in explanation.do


@pytest.mark.parametrize("other", [Peer("10.0.0.7", 1), None], ids=["another master's", "before one that was taken"])
def test_a_refused_write_that_has_kept_no_heartbeat_from_us_is_not_blamed(other: Peer | None) -> None:
    wired = Wired(with_supervision(strict(), lease_s=0.2)).ready()
    wired.write(0, ENABLE, 1500, 0, 0, 1)
    with pytest.raises(Refusal):
        wired.write(1, BEYOND, peer=other or MASTER)
    if other is None:
        wired.write(4, 2)
    wired.until(lambda: wired.state is State.FAULT, 0.5)
    (told,) = (sentence for _, sentence in wired.log if sentence.startswith("A310 "))
    assert "refused" not in told


def test_what_may_be_the_limit_is_told_with_the_refusal() -> None:
    """The calibration in use may allow less than the rig, and was not among the reasons."""
    assert "calibration in use" in RefusalReason.OUT_OF_RANGE.explanation.probably
