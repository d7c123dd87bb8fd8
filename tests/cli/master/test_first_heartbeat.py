"""What a verb that commands begins with, when it is called again at once."""

import pytest

from gateway.codes.refusals import RefusalReason
from gateway.registers import BankRules, RegisterBank, RegisterMap
from gateway.registers.rig_rules import BASIC_BITS
from gateway.registers.words import ControlBit
from gateway.registers.writes.proposed_write import EdgeRefusal, ProposedWrite


@pytest.mark.parametrize("words", [("calibrate", "--yes"), ("self-test",), ("hold", "12")])
def test_a_verb_that_was_refused_is_no_program_that_stands_still_when_it_is_called_again(
    words: tuple[str, ...], register_map: RegisterMap, serve, call
) -> None:
    """Run again within three seconds it was told W302, whatever had been mended meanwhile."""
    runs, repeats = ControlBit.START_CALIBRATION | ControlBit.START_SELF_TEST, list[bool]()

    def refuse(proposal: ProposedWrite) -> EdgeRefusal | None:
        if not proposal.command.control_word & (runs | ControlBit.ENABLE):
            return None
        repeats.append(proposal.command.repeats)
        return EdgeRefusal(RefusalReason.CELL_SILENT, proposal.command.control_word, "refused: the load cell is silent")

    bank = RegisterBank(
        register_map,
        BankRules(rig_name="cell", force_max_n=60.0, supported_bits=BASIC_BITS | runs, has_lease=True),
        now=lambda: 0.0,
    )
    bank.on_asked = refuse
    gateway = serve(bank).address
    answers = [call(*words, "--gateway", gateway) for _ in range(2)]
    assert repeats == [False, False]
    assert all(RefusalReason.CELL_SILENT.code in answer.output for answer in answers)
