"""The register bank: what a Modbus server asks for and writes to, and the place where commands are accepted or refused.

Checks run in this order: address (02), role (01, gateway.registers.roles), whole values (03), values (03), owner (06), then
what the state allows. Everything is checked before anything is stored; a refusal leaves no trace but the last-refusal
registers. One accepted write is one Command, handed on inside the write, so that a setpoint acts before its answer is
sent. The Command carries the edge bits as written, each write with a new number; in the registers they read back as 0.
Whether an edge can be taken now control says, asked before anything is stored: what is accepted here is done there.

Decisions: a write to a read-only register is 02, as to an address that cannot be written. Refused reads are noted like
refused writes, so that a newcomer's 40001 can be explained. Clearing enable also clears control_word, force_setpoint
and voltage_setpoint (an old voltage must not wait for the next enable), releases the ownership, and is granted to any
peer without an edge beside it, as is clearing start_calibration: then nothing else of its write is taken. A takeover in the
write that disables holds. byte_order_echo takes 1234.5 in both word orders and reads back; it proves the order of one host.
"""

from collections.abc import Callable, Mapping, Sequence

from gateway.bsfm.model import Calibration
from gateway.codes.refusals import RefusalReason
from gateway.modbus import Peer, RequestError, ServerId
from gateway.modbus.bits import pack_bits
from gateway.modbus.peer import NOBODY
from gateway.registers.command import Command, Status
from gateway.registers.identity import build_identity, build_server_id
from gateway.registers.image import RegisterImage
from gateway.registers.map.addresses import no_such_address, read_only
from gateway.registers.map.bit_words import BitWords, mask_of_bits
from gateway.registers.map.register_map import Block, RegisterMap
from gateway.registers.refusal import Refusal, request_refusal
from gateway.registers.rig_rules import BankRules
from gateway.registers.roles import role_refusal, write_roles
from gateway.registers.self_test_words import SelfTestWords
from gateway.registers.status_block import StatusBlock
from gateway.registers.upload.staging_block import NO_SLOT, StagingBlock
from gateway.registers.words import ControlBit, State, StatusBit
from gateway.registers.writes.accepted_sentence import accepted_sentence
from gateway.registers.writes.admission import Admission
from gateway.registers.writes.admitted_write import ALL_BITS, AdmittedWrite, OnWrite, Write
from gateway.registers.writes.byte_order_echo import ByteOrderEcho
from gateway.registers.writes.command_block import (
    CONTROL_WORD,
    FORCE_SETPOINT,
    VOLTAGE_SETPOINT,
    CommandBlock,
    check_zeros,
)
from gateway.registers.writes.ownership import LastWriters, Ownership
from gateway.registers.writes.proposed_write import Decide
from gateway.registers.writes.repeated_write import RepeatedWrite


class RegisterBank:
    """Implements gateway.modbus.DataBank. Single-threaded; callbacks run inside the write or read that causes them.

    on_command: each accepted command write; on_refusal: each refusal; on_accepted: a sentence for each write that changed more
    than heartbeat and sequence; on_write (none that repeats the last), on_refused_write: each, for the audit. now: s.
    """

    def __init__(self, register_map: RegisterMap, rules: BankRules, *, now: Callable[[], float]) -> None:
        self.command = Command()
        self.on_command: Callable[[Command], None] = lambda command: None
        self.on_refusal: Callable[[Refusal, Peer], None] = lambda refusal, peer: None
        self.on_accepted: Callable[[str, Peer], None] | None = None
        self.on_write: OnWrite | None = None
        self.on_refused_write: Callable[[Refusal, Peer], None] = lambda refusal, peer: None
        self._writers, self._now, self.refusals = LastWriters(), now, 0  # refused since the start
        self.last_refusal: Refusal | None = None
        self.identity: Mapping[int, bytes] = build_identity(register_map.name, rules.rig_name)
        self._roles, self._map = write_roles(register_map.blocks), register_map
        self._image = image = RegisterImage(register_map)
        self._words, self._room, self.known_answers = memoryview(image.data), image.room, image.known_answers
        self._command_block, self._command_role = register_map.block("command"), self._roles["command"]
        self._commands = CommandBlock(register_map, rules, self._image)
        self._status = StatusBlock(register_map, self._image)
        self.show_watchdogs = self._status.show_watchdogs
        self._tell_status: Callable[[], Status] | None = None
        self.self_test, self._bit_words = SelfTestWords(register_map, self._image), BitWords(register_map)
        self._ownership, self._owner_peer = Ownership(rules.owner), NOBODY
        self.owner_refused, self.owner_refused_s = "", float("-inf")  # why the last was, empty: taken; when one was
        self._echo = ByteOrderEcho(register_map.find("byte_order_echo"), self._image)
        self._admission = Admission(self._commands, self._ownership, self._echo, rules)
        self._repeated = RepeatedWrite(self._admission, self._commands, self._ownership)
        self.held_runs, self.held_enables = self._admission.held_runs, self._admission.held_enables
        self.staging = StagingBlock(register_map, self._image)
        self._image.put(register_map.find("map_version"), register_map.version)
        self._image.put(register_map.find("map_hash"), register_map.map_hash)
        self._show_owner()
        self.publish(Status())

    @property
    def owner(self) -> str | None:
        """Identity of who may command: an address, or `certificate NAME`; None for nobody yet."""
        return self._ownership.owner

    @property
    def server_id(self) -> ServerId:
        """The identity for FC17. It runs unless a fault is latched: whether a force is held is in status_word."""
        self._catch_up()
        status = self._image.word(self._bit_words.status.first)
        return build_server_id(self.identity, is_running=not status & StatusBit.FAULT)

    def note_refusal(self, refusal: RequestError, peer: Peer) -> None:
        """Note the reason of what the framing has refused, as all others do."""
        noted = request_refusal(refusal)
        self._note_refused_write(noted, peer) if refusal.is_write else self._note_refusal(noted, peer)

    def read_registers(self, address: int, count: int, peer: Peer = NOBODY) -> bytes:
        """Return big-endian words of one block. Refusal (02) for a range that no block holds."""
        if not 0 < count <= self._room[address]:
            raise self._note_refusal(no_such_address(self._map.blocks, address, count), peer)
        if self._image.is_behind:
            self._catch_up()
        return self._words[2 * address : 2 * (address + count)].tobytes()

    def check_registers_readable(self, address: int, count: int, peer: Peer = NOBODY) -> None:
        """Check that these registers can be read, of a request that writes behind that; Refusal (02) as `read_registers`."""
        if not 0 < count <= self._room[address]:
            raise self._note_refused_write(no_such_address(self._map.blocks, address, count), peer)

    def read_bits(self, address: int, count: int, peer: Peer = NOBODY, *, is_write: bool = False) -> bytes:
        """Return bits of control_word (0-15) or status_word (100-115), packed. is_write: of a request that would write."""
        try:
            first = self._bit_words.find(address, count).first
        except Refusal as refusal:
            raise (self._note_refused_write if is_write else self._note_refusal)(refusal, peer) from None
        self._catch_up()
        bits = self._image.word(first) >> (address - first)
        return pack_bits([bool(bits >> k & 1) for k in range(count)])

    def write_registers(self, address: int, data: bytes, peer: Peer) -> None:
        """Write all or nothing. Refusal says why not; nothing but the last-refusal registers has changed then."""
        try:
            if address == self._command_block.first and self._repeat(data, peer):
                pass
            elif self._is_command(address, len(data) // 2, peer):
                self._write_command(self._command_block, address, data, peer)
            else:
                self._write(address, data, peer)
        except Refusal as refusal:
            raise self._note_refused_write(refusal, peer) from None

    def _repeat(self, data: bytes, peer: Peer) -> bool:
        """Take a write that repeats the last one with another heartbeat; False where it is another one."""
        if (again := self._repeated.take(data, peer, self.command, self._now)) is None:
            return False
        self.command, self.owner_refused = again, ""
        if peer is not self._owner_peer and peer.identity == self._ownership.owner:
            self._owner_peer = peer
            self._show_owner()
        self.on_command(again)
        self._writers.note(self._repeated.names, peer, again.received_s)
        return True

    def _is_command(self, address: int, count: int, peer: Peer) -> bool:
        """Whether `_write` would hand this to the command block: the commonest write, found out in one look."""
        block = self._command_block
        is_inside = block.first <= address <= block.last and 0 < count <= self._image.writable[address]
        return is_inside and peer.role >= self._command_role

    def write_bits(self, address: int, values: Sequence[bool], peer: Peer) -> None:
        """Write coils 0-15: the control word is read, changed and written under the same checks as by register."""
        try:
            of = self._bit_words.find(address, len(values))
            if of is not self._bit_words.control:
                why = f"bits {of.first} .. {of.last} are {of.name}, read only"
                raise Refusal(RefusalReason.READ_ONLY, address, why)
            self._catch_up()
            mask, bits = mask_of_bits(address - of.first, values)
            self._write(of.first, (self._image.word(of.first) & ~mask | bits).to_bytes(2, "big"), peer, mask)
        except Refusal as refusal:
            raise self._note_refused_write(refusal, peer) from None

    def mask_write(self, address: int, and_mask: int, or_mask: int, peer: Peer) -> None:
        """Write some bits of one word, under the same checks as any write."""
        self._catch_up()
        word, touched = self._image.word(address) if self._room[address] else 0, ~and_mask & ALL_BITS
        try:
            self._write(address, (word & and_mask | or_mask & touched).to_bytes(2, "big"), peer, touched)
        except Refusal as refusal:
            raise self._note_refused_write(refusal, peer) from None

    @property
    def on_asked(self) -> Decide:
        """Function of control that takes or refuses a whole command before it is stored."""
        return self._admission.decide

    @on_asked.setter
    def on_asked(self, decide: Decide) -> None:
        self._admission.decide = decide

    def publish(self, status: Status) -> None:
        """Show what control and service know."""
        self.publish_when_read(status.state, lambda: status)

    def publish_when_read(self, state: State, tell: Callable[[], Status]) -> None:
        """Show what `tell` says when somebody reads next: most that is published, nobody reads. state: of control."""
        self._admission.note_state(state, tell)
        self._tell_status = tell
        self._image.fall_behind()

    def _catch_up(self) -> None:
        """Pack what has been accepted and published since the last read: most of it is never read."""
        self._image.is_behind = False
        self._commands.show()
        if self._tell_status is not None:
            self._status.publish(self._tell_status())
            self._tell_status = None

    def clear_command(self) -> None:
        """Clear control_word and the setpoints, because control has switched the output off. The Command keeps its number."""
        values = self._commands.values
        if values[CONTROL_WORD] or values[FORCE_SETPOINT] or values[VOLTAGE_SETPOINT] or self.command.control_word:
            cleared = values.copy()
            cleared[FORCE_SETPOINT] = cleared[VOLTAGE_SETPOINT] = 0.0
            self._commands.store(cleared, 0)
            self._admission.lowered_from_n = 0.0
            self._amend(force_setpoint_n=0.0, voltage_setpoint_v=0.0, lowered_from_n=0.0)
        self._ownership.rest()
        self._show_owner()

    def release_owner(self) -> None:
        """Make nobody the owner of the setpoint (unless the rig names the owner)."""
        self._ownership.release()
        self._show_owner()

    def set_active_model(self, calibration: Calibration, slot: int = NO_SLOT) -> str:
        """Show the coefficients in use in the active block, and their hash, and hold to their force limits. slot: which
        recipe they are, if any. Returns a sentence where the setpoint in use had to be lowered, else an empty one."""
        self._commands.allow_force(calibration.force_limits_n, f"calibration {calibration.number}")
        self.staging.show_active(calibration, slot)
        lowered = self._commands.lower_force()
        if lowered is None:
            return ""
        (before_n, after_n), requested_n = lowered, self.command.force_requested_n or lowered[0]
        self._admission.lowered_from_n = requested_n
        self._amend(force_setpoint_n=after_n, lowered_from_n=requested_n)
        allowed = f"calibration {calibration.number} allows no more"
        return f"W314 force_setpoint lowered from {before_n:.2f} N to {after_n:.2f} N: {allowed}"

    def _amend(self, **changes: float) -> None:
        """The command in use becomes another one without a write: same number, none of its edges again."""
        word = ControlBit(int(self._commands.values[CONTROL_WORD]))
        self.command = self.command._replace(control_word=word, stops=False, **changes)  # type: ignore[arg-type]

    def _note_refusal(self, refusal: Refusal, peer: Peer) -> Refusal:
        self.last_refusal = refusal
        self.refusals += 1
        self._status.show_refusal(refusal)
        self.on_refusal(refusal, peer)
        return refusal

    def _note_refused_write(self, refusal: Refusal, peer: Peer) -> Refusal:
        if peer.identity == self.owner:
            self.owner_refused, self.owner_refused_s = refusal.sentence, self._now()
        self.on_refused_write(refusal, peer)
        return self._note_refusal(refusal, peer)

    def _write(self, address: int, data: bytes, peer: Peer, touched: int = ALL_BITS) -> None:
        count = len(data) // 2
        if not 0 < count <= self._room[address]:
            raise no_such_address(self._map.blocks, address, count)
        if count > self._image.writable[address]:
            raise read_only(self._image.register_at[address + self._image.writable[address]])
        block = self._image.block_at[address]
        if peer.role < (needed := self._roles[block.name]):
            raise role_refusal(peer, block, needed, address)
        if block.name == "staging":
            self.staging.write(address, data, peer)
            self._writers.note(("staging",), peer, self._now())
            return
        if (cut := self._image.cuts_value(address, count)) is not None:
            text = f"{cut.name}@{cut.block} is the registers {cut.address} and {cut.address + 1}: write both in one request"
            raise Refusal(RefusalReason.HALF_VALUE, address, text)
        if self._commands.holds(block, address):
            self._write_command(block, address, data, peer, touched)
        elif block.name == "proof":
            self._write_echo(address, data, peer)
        else:
            check_zeros(address, data)

    def _write_echo(self, address: int, data: bytes, peer: Peer) -> None:
        if (order := self._echo.write(address, data, peer.identity)) is not None:
            self._writers.note(("byte_order_echo",), peer, self._now())
            self._tell(f"byte_order_echo {order.upper()}: use {self._map.name_float_block(order)}", peer)

    def _write_command(self, block: Block, address: int, data: bytes, peer: Peer, touched: int = ALL_BITS) -> None:
        now_s, write = self._now(), Write(block, address, data, peer.identity, peer, touched)
        if (admitted := self._admission.admit(write, self.command.number + 1, now_s)) is None:
            return
        before, owner = self._commands.values, self._ownership.owner
        self._commands.store(admitted.values, admitted.kept)
        self._admission.note_stored(admitted, before)
        self._settle_owner(admitted, write.host, peer)
        owners = owner, self._ownership.owner  # by this write; what control does in it is not its master's
        names = self._commands.names(write.block, write.address, len(write.data) // 2)
        if admitted.is_plain and address == self._command_block.first:
            self._repeated.note(data, peer, admitted.command, names)
        self.command = admitted.command
        self.on_command(self.command)
        is_guest = owner not in (None, write.host) and not admitted.is_taken_over  # nothing else of its write was taken
        self._writers.note(names[:1] if is_guest else names, peer, now_s)
        if self.on_write is not None:
            self.on_write(peer, before, admitted, owners)
        if self.on_accepted is not None:
            changes = self._commands.differences(before, admitted.values)
            self._tell(accepted_sentence(changes, admitted, owners), peer)

    @property
    def last_writer(self) -> dict[str, tuple[Peer, float]]:
        """Register name ("staging" for its whole block) -> (peer, time in s)."""
        return self._writers.by_name()

    def _settle_owner(self, admitted: AdmittedWrite, host: str, peer: Peer) -> None:
        ownership, values = self._ownership, admitted.values
        asks = bool(admitted.kept or values[FORCE_SETPOINT] or values[VOLTAGE_SETPOINT]) and not admitted.stands
        if ownership.owner != (host if asks else None) or admitted.is_stop or admitted.is_taken_over:
            ownership.settle(host, takes_over=admitted.is_taken_over, stops=admitted.is_stop, asks=asks)
        elif not asks or peer is self._owner_peer:
            self.owner_refused = ""
            return  # nothing else of it is another
        if ownership.owner == host:
            self._owner_peer, self.owner_refused = peer, ""
        self._show_owner()

    def _show_owner(self) -> None:
        self._status.show_owner(self._ownership.owner, self._owner_peer)

    def _tell(self, sentence: str, peer: Peer) -> None:
        if self.on_accepted is not None and sentence:
            self.on_accepted(sentence, peer)
