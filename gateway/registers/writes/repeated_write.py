"""The commonest write of a master that writes in cycles: its last plain one once more, with another heartbeat.

All that was found good about the last one still is when the same master sends the same words of the int16 block and nothing
that they were judged by has changed; control is asked as of any write. Whatever is not plainly this case, or is refused, is
judged as all others are.
"""

from collections.abc import Callable, Sequence
from typing import Any, Final

from gateway.modbus import Peer
from gateway.modbus.peer import NOBODY
from gateway.registers.command import Command
from gateway.registers.writes.admission import Admission
from gateway.registers.writes.command_block import HEARTBEAT, CommandBlock
from gateway.registers.writes.ownership import Ownership
from gateway.registers.writes.proposed_write import ProposedWrite

_BEFORE: Final = 2 * HEARTBEAT
_BEHIND: Final = _BEFORE + 2
_AT_HEARTBEAT: Final = Command._fields.index("heartbeat")
_AT_NUMBER: Final = Command._fields.index("number")
_AT_RECEIVED: Final = Command._fields.index("received_s")
_AT_CHANNEL: Final = Command._fields.index("channel")
_new: Final = tuple.__new__  # of a named tuple with all its fields: in half of the time of its own


class RepeatedWrite:
    """Takes a write that repeats the last one (`note`), without judging it a second time."""

    def __init__(self, admission: Admission, commands: CommandBlock, ownership: Ownership) -> None:
        self._admission, self._commands, self._ownership = admission, commands, ownership
        self.note(b"", NOBODY, Command(), ())

    def note(self, data: bytes, peer: Peer, command: Command, names: Sequence[str]) -> None:
        """Note a plain write of the words from the first on that was accepted: what it became, which registers it set."""
        before = data[:_BEFORE] if len(data) > _BEFORE else None  # without a heartbeat nothing repeats it
        self._last = before, data[_BEHIND:], peer, names, self._ownership.owner, self._commands.fields
        self._command = command

    def take(self, data: bytes, peer: Peer, current: Command, now: Callable[[], float]) -> Command | None:
        """Store these words from the first on, and return what they become; None, and nothing is stored, where they do not
        repeat the last write or control refuses them. current: the command in use. Refusal (03) for a bad heartbeat."""
        before, behind, its_peer, _, owner, fields = self._last
        if data[:_BEFORE] != before or data[_BEHIND:] != behind or self._command is not current or len(data) <= _BEFORE:
            return None
        if owner != self._ownership.owner or fields is not self._commands.fields:
            return None
        if not (peer is its_peer or _is_same_master(peer, its_peer)) or not self._admission.is_usual(peer.identity):
            return None
        if (field := fields[HEARTBEAT]) is None:
            return None
        heartbeat = int(field.of_word(data[_BEFORE] << 8 | data[_BEFORE + 1], self._commands.first + HEARTBEAT))
        values: list[Any] = list(current)
        values[_AT_HEARTBEAT] = heartbeat
        values[_AT_NUMBER] += 1
        values[_AT_RECEIVED] = now()
        values[_AT_CHANNEL] = peer.identity, peer.host, peer.port, self._commands.first, len(data)
        command = _new(Command, values)
        if self._admission.decide(_new(ProposedWrite, (command, tuple))):
            return None
        self._admission.held_enables.follow_later(command)
        if heartbeat != current.heartbeat:
            self._commands.store_heartbeat(heartbeat)
        self._command = command
        return command

    @property
    def names(self) -> Sequence[str]:
        """The registers that the last write set."""
        return self._last[3]


def _is_same_master(peer: Peer, other: Peer) -> bool:
    """Whether this is another connection of the same master, and what it asks has not waited."""
    return peer.identity == other.identity and peer.role is other.role and not peer.is_behind
