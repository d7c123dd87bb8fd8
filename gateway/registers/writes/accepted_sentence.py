"""What an accepted write has changed, for the log."""

from gateway.registers.words import ControlBit
from gateway.registers.writes.admission import EDGE_BITS, TAKE
from gateway.registers.writes.admitted_write import AdmittedWrite


def accepted_sentence(changes: str, admitted: AdmittedWrite, owners: tuple[str | None, str | None]) -> str:
    """Return what an accepted write changed; empty when nothing that people want to know. owners: before and after."""
    edges = int(admitted.command.control_word) & EDGE_BITS & ~TAKE
    edge_names = _names_of(edges) if edges else ""  # most writes have none
    before, after = owners
    change_of_owner = f"owner {before or 'nobody'} -> {after or 'nobody'}" if before != after else ""
    return ", ".join(part for part in (changes, edge_names, change_of_owner) if part)


def _names_of(edges: int) -> str:
    return ", ".join(bit.name.lower() for bit in ControlBit if bit & edges and bit.name)
