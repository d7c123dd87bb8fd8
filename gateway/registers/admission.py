"""May this write of the command block be used, and what does it become? All checks, in order, before anything is stored.

Values (03), owner (06), what a reset needs (03), then what an enable needs (04, 06 or 0x0B).
"""

from typing import Final, NamedTuple

from gateway.registers.command_block import (
    CONTROL_WORD,
    FORCE_SETPOINT,
    VOLTAGE_SETPOINT,
    CommandBlock,
    Values,
)
from gateway.registers.echo import ByteOrderEcho
from gateway.registers.map import Block
from gateway.registers.ownership import Ownership
from gateway.registers.refusal import Refusal
from gateway.registers.rules import BankRules
from gateway.registers.words import ControlBit, RefusalReason

ENABLE: Final = int(ControlBit.ENABLE)
RESET: Final = int(ControlBit.RESET_FAULT)
TAKE: Final = int(ControlBit.TAKE_OWNERSHIP)
STARTS: Final = int(ControlBit.ENABLE | ControlBit.START_CALIBRATION)
EDGE_BITS: Final = int(ControlBit.RESET_FAULT | ControlBit.TARE | ControlBit.TAKE_OWNERSHIP)

_BLOCKED: Final = {
    RefusalReason.FAULT_LATCHED: "a fault is latched: see fault_code, then write force_setpoint 0 and reset_fault (bit 1)",
    RefusalReason.NOT_READY: "not ready yet: wait for bit 1 (ready) of status_word",
    RefusalReason.OUTPUT_FAULT: "the output device does not answer as it should: power, cable, baud?",
    RefusalReason.CELL_SILENT: "no fresh sample of the load cell: power, cable, stream mode?",
    RefusalReason.BYTE_ORDER_UNPROVEN: "this rig wants 1234.5 in byte_order_echo first, in your client's word order",
    RefusalReason.BUSY: "busy with something else: try again",
}


class Admitted(NamedTuple):
    """values: to store; written: control word, edge bits included; kept: what reads back; is_stop: enable was cleared."""

    values: Values
    written: int
    kept: int
    is_stop: bool


class Admission:
    """enable_block: why an enable would be refused now, as control publishes it."""

    def __init__(self, commands: CommandBlock, ownership: Ownership, echo: ByteOrderEcho, rules: BankRules) -> None:
        self.enable_block = RefusalReason.NONE
        self._commands = commands
        self._ownership = ownership
        self._echo = echo
        self._rules = rules

    def admit(self, block: Block, address: int, data: bytes, host: str) -> Admitted | None:
        """What a write becomes; None when it is somebody else's stop and there is nothing to stop. Raises Refusal."""
        commands = self._commands
        values = commands.decode(block, address, data)
        count = len(data) // 2
        commands.check_known(values, block)
        word_at = commands.address(block, CONTROL_WORD)
        sets_word = address <= word_at < address + count
        written, before = int(values[CONTROL_WORD]), int(commands.values[CONTROL_WORD])
        is_stop = bool(before & ENABLE and not written & ENABLE)
        if not self._may_command(host, written):
            if is_stop:
                values, written = commands.values.copy(), 0
            elif sets_word and not written and count == block_words(block):
                return None
            else:
                raise self._not_owner(address, host)
        if is_stop:
            values[FORCE_SETPOINT] = values[VOLTAGE_SETPOINT] = 0.0
        if written & RESET:
            self._check_reset(values, written, word_at)
        if written & ~before & STARTS:
            self._check_enable(host, written, word_at)
        return Admitted(values, written, 0 if is_stop else written & ~EDGE_BITS, is_stop)

    def _may_command(self, host: str, written: int) -> bool:
        return self._ownership.admits(host) or bool(written & TAKE and self._ownership.may_take_over(host))

    def _not_owner(self, address: int, host: str) -> Refusal:
        cure = (
            "write control_word with bit 3 to take over"
            if self._ownership.may_take_over(host)
            else "this rig names its owner"
        )
        text = f"{self._ownership.owner} owns the setpoint, {host} may read and clear enable: {cure}"
        return Refusal(RefusalReason.NOT_OWNER, address, text)

    def _check_reset(self, values: Values, written: int, word_at: int) -> None:
        held = [
            f"{field.name} is {field.shown(values[k])}"
            for k, field in enumerate(self._commands.fields)
            if field is not None and k in (FORCE_SETPOINT, VOLTAGE_SETPOINT) and values[k]
        ]
        if written & ENABLE:
            held.insert(0, "enable is 1")
        if held:
            text = f"reset_fault needs enable 0 and setpoint 0: {' and '.join(held)}"
            raise Refusal(RefusalReason.RESET_NEEDS_ZERO, word_at, text, value=float(written))

    def _check_enable(self, host: str, written: int, word_at: int) -> None:
        reason = self.enable_block
        if not reason and self._rules.require_byte_order_echo and not self._echo.is_proven_by(host):
            reason = RefusalReason.BYTE_ORDER_UNPROVEN
        if reason:
            text = f"enable refused: {_BLOCKED.get(reason, reason.name.lower())}"
            raise Refusal(reason, word_at, text, value=float(written))


def block_words(block: Block) -> int:
    """Registers of the control word alone in this face."""
    return 2 if block.repeats else 1
