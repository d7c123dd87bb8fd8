"""What the bank asks control before it takes a write, and what control answers.

An edge (enable, reset, tare, start calibration) is decided inside the write that carries it, by control, for control alone
knows whether it can take it; the decision is the answer to the master. Only what control has not refused is stored.
"""

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

from gateway.codes.refusals import RefusalReason
from gateway.registers.command import Command
from gateway.registers.words import ControlBit


class ProposedWrite(NamedTuple):
    """A write that would be taken. command: as it would be handed on; changes: tells the names of the registers that it would
    change, control_word, heartbeat and command_sequence apart (most writes are taken without anybody asking for them)."""

    command: Command
    changes: Callable[[], tuple[str, ...]] = tuple


class EdgeRefusal(NamedTuple):
    """Why a write cannot be taken now. bit: the edge that stands for it, 0 where it is the whole write; text: for people,
    without the code."""

    reason: RefusalReason
    bit: ControlBit
    text: str


Decide: TypeAlias = Callable[[ProposedWrite], EdgeRefusal | None]


def decide_nothing(proposal: ProposedWrite) -> None:
    """Take everything: stands for control where there is none."""
