"""Which block of the map needs which role to be written: the one table, for plain faces and TLS alike.

Everybody may read everything, and who may write a block may do so by every function that reaches it (FC05, 06, 15, 16, 22,
23). A role that may not is answered 01, as the Modbus/TCP Security specification has it (MB-TCP-Security-v36),
with reason W211 in the refusal registers. Reserved words of a block need the block's role too.

Decisions: byte_order_echo needs the role setpoint, because what it proves is asked of who enables. A block that this table
does not name (of a map of one's own) can be written by the role admin only: forgetting one locks it.
"""

from collections.abc import Iterable, Mapping
from typing import Final

from gateway.codes.refusals import RefusalReason
from gateway.modbus.peer import Peer, Role
from gateway.registers.map.register_map import Block, RegisterMap
from gateway.registers.refusal import Refusal
from gateway.registers.writes.ownership import serial_place

WRITE_ROLES: Final[Mapping[str, Role]] = {
    "command": Role.SETPOINT,
    "float_abcd": Role.SETPOINT,
    "float_cdab": Role.SETPOINT,
    "proof": Role.SETPOINT,
    "staging": Role.CALIBRATION,
    "status": Role.SETPOINT,
    "active": Role.SETPOINT,
}
"""The lowest role that may write a block. In status and active that is a 0 in reserved words, the rest is read only."""


def write_roles(blocks: Iterable[Block]) -> dict[str, Role]:
    """Return the lowest role that may write each of these blocks, by its name."""
    return {block.name: WRITE_ROLES.get(block.name, Role.ADMIN) for block in blocks}


def role_refusal(peer: Peer, block: Block, needed: Role, address: int) -> Refusal:
    """Return why this peer may not write this block (01), and what would let it."""
    have, needs = peer.role.name.lower(), needed.name.lower()
    if peer.name:
        cure = f"connect with a certificate that has it (force-gateway certs --client NAME:{needs})"
    elif serial_place(peer.host) is not None and needed <= Role.CALIBRATION:
        cure = f"set `role: {needs}` of this face in the rig file, or connect by TLS with a certificate that has it"
    elif needed is Role.CALIBRATION:
        cure = "set network.allow_plain_upload in the rig file, or connect by TLS with a certificate that has it"
    else:
        cure = "connect by TLS with a certificate that has it"
    text = f"the role of {peer} is {have}, block {block.name} ({block.first} .. {block.last}) needs {needs}: {cure}"
    return Refusal(RefusalReason.ROLE, address, text)


def render_roles(register_map: RegisterMap) -> str:
    """Return the table of roles for people, in Markdown, without heading: a line per block, a column per role."""
    roles = tuple(Role)
    rows = [("block", "addresses", *(role.name.lower() for role in roles)), ("---",) * (2 + len(roles))]
    for block in register_map.blocks:
        is_writable = any(register.is_writable for register in register_map.registers_of(block.name))
        needed = write_roles((block,))[block.name]
        may = ("read, write" if is_writable and role >= needed else "read" for role in roles)
        rows.append((block.name, f"{block.first} .. {block.last}", *may))
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)
