"""May this write of the command block be used, and what does it become? All checks, in order, before anything is stored.

Values (03), owner (06), what control says to the edges and to a write while it is busy (`Decide`), then what the bank alone
knows: whether the bit of a run was held at 1 (04), and whether an enable has its byte-order proof (06).

Who clears enable wants the output off, and is never refused; an edge beside it is decided all the same, so that a lone
start_calibration or tare while a force is held is an answer with a reason, and no stop. start_calibration or start_self_test
alone keeps the output: then the bit takes enable's place. Of who owns nothing an edge is refused (06), and the stop beside it
with it: taken for a stop alone, a guest's tare would be the end of the force, and its answer a lie.
"""

from collections.abc import Callable
from contextlib import suppress
from typing import Final

from gateway.codes.refusals import RefusalReason
from gateway.registers.command import NO_BEAT, Channel, Command, Status
from gateway.registers.refusal import Refusal
from gateway.registers.rig_rules import BankRules
from gateway.registers.words import RUN_BITS, ControlBit, State
from gateway.registers.writes.admitted_write import ALL_BITS, AdmittedWrite, PermittedWrite, Write
from gateway.registers.writes.byte_order_echo import ByteOrderEcho
from gateway.registers.writes.command_block import (
    CONTROL_WORD,
    FORCE_SETPOINT,
    HEARTBEAT,
    MODE,
    NAMES,
    SEQUENCE,
    VOLTAGE_SETPOINT,
    CommandBlock,
    Values,
)
from gateway.registers.writes.held_starts import HeldEnables, HeldRuns, StartFrame
from gateway.registers.writes.left_setpoints import without_left_setpoints
from gateway.registers.writes.ownership import Ownership
from gateway.registers.writes.proposed_write import Decide, ProposedWrite, decide_nothing

ENABLE, TARE = int(ControlBit.ENABLE), int(ControlBit.TARE)
TAKE: Final = int(ControlBit.TAKE_OWNERSHIP)
STARTS: Final = ENABLE | int(RUN_BITS)
EDGE_BITS: Final = int(ControlBit.RESET_FAULT | ControlBit.TARE | ControlBit.TAKE_OWNERSHIP)
RUN_BITS_OR_EDGES: Final = EDGE_BITS | int(RUN_BITS)
_ASKING: Final = RUN_BITS | TARE
_BUSY: Final = (RefusalReason.NOT_OWNER, RefusalReason.CALIBRATING, RefusalReason.STOPPING)
_BEHIND_HEARTBEAT: Final = 2 * HEARTBEAT + 1  # bytes
_SILENT: Final = (CONTROL_WORD, HEARTBEAT, SEQUENCE)


class Admission:
    """decide: what control says to a write. is_calibrating: a run has the output.
    lowered_from_n: of the setpoint in use, what the master wrote, 0 where nothing was lowered."""

    def __init__(self, commands: CommandBlock, ownership: Ownership, echo: ByteOrderEcho, rules: BankRules) -> None:
        self.decide: Decide = decide_nothing
        self.note_state(State.OFF, Status)
        self.lowered_from_n = 0.0
        self.held_runs, self.held_enables = HeldRuns(), HeldEnables(has_lease=rules.has_lease)
        self._commands = commands
        self._ownership = ownership
        self._echo = echo
        self._rules = rules

    def admit(self, write: Write, number: int, now_s: float) -> AdmittedWrite | None:
        """Return what a write becomes; None when it is somebody else's stop and there is nothing to stop. Raises Refusal."""
        try:
            return self._admit(write, number, now_s)
        except Refusal as refusal:
            self.held_enables.follow()
            self._note_refused(write, refusal.reason, now_s)
            raise

    def _admit(self, write: Write, number: int, now_s: float) -> AdmittedWrite | None:
        commands, before = self._commands, self._commands.values
        values = commands.decode(write.block, write.address, write.data)
        asked, heartbeat = int(values[CONTROL_WORD]), int(values[HEARTBEAT])
        if asked != before[CONTROL_WORD] or values[MODE] != before[MODE]:  # else they have been found good
            commands.check_known(values, write.block)
        if asked == before[CONTROL_WORD] and self._is_plain(write, asked):
            command = commands.command(values, asked, number, now_s, self._sender(write))
            self._ask(command, values, write)
            self.held_enables.follow_later(command)
            return AdmittedWrite(values, asked, command, False, False, 0, True)
        self.held_enables.follow()
        permitted = self._permit(write, values, now_s)
        if permitted is None:
            self._hear(write, asked, heartbeat, now_s)
            self.held_runs.keep(write.host, self._held_by(write, asked, asked))
            return None
        is_guest = permitted.values is not values
        values, written, is_stop = permitted
        if is_stop:
            values[FORCE_SETPOINT] = values[VOLTAGE_SETPOINT] = 0.0
        is_taken_over = bool(written & TAKE)
        is_begun_anew = self._is_begun_anew(write.host, is_taken_over=is_taken_over)
        if is_begun_anew:
            values = without_left_setpoints(commands, values, self._offsets(write), self._tell())
        command = commands.command(values, written, number, now_s, self._sender(write, is_guest=is_guest))
        is_said_anew = is_stop or is_begun_anew or FORCE_SETPOINT in self._offsets(write)
        frame = self._frame(write, int(values[HEARTBEAT]), written)
        repeats = not self._is_in_use(write.host) and self.held_enables.repeats(write.host, frame, now_s)
        lowered_n, waits = 0.0 if is_said_anew else self.lowered_from_n, write.peer.is_behind
        command = command._replace(stops=is_stop, lowered_from_n=lowered_n, has_waited=waits, repeats=repeats)
        self._ask(command, permitted.values, write)
        word_at = commands.address(write.block, CONTROL_WORD)
        self._check_tare(command, word_at, frame)
        self._check_starts(command, word_at)
        self._hear(write, asked, heartbeat, now_s)
        edges_kept = 0 if is_stop else written & ~EDGE_BITS
        held = self._held_by(write, written, asked)
        stands = bool(repeats and edges_kept and self._ownership.owner is None)
        return AdmittedWrite(values, edges_kept, command, is_stop, is_taken_over, held, stands=stands)

    def note_state(self, state: State, tell: Callable[[], Status]) -> None:
        """Note the state of control, and who tells the rest: what may be asked for, and left behind, depends on it."""
        self.is_calibrating, self._tell = state is State.CALIBRATING, tell

    def note_stored(self, admitted: AdmittedWrite, before: Values) -> None:
        """Remember what a write that was stored has held and lowered, and whom it has stopped, in a run, too, or has taken over
        from: the last frame of that one may flow on into the next process. before: values that stood."""
        if not self._ownership.admits(admitted.command.peer):
            self.held_enables.note_lost(self._ownership.owner, int(before[HEARTBEAT]))
        if admitted.held or self.held_runs.by_host:
            self.held_runs.keep(admitted.command.peer, admitted.held)
        self.lowered_from_n = admitted.command.lowered_from_n

    def _is_plain(self, write: Write, word: int) -> bool:
        """The commonest write of all, a setpoint and a heartbeat of the owner: no bit rises or falls, it held none, nothing
        was lowered, no run has the output, it has not waited. What the checks below would find is known."""
        is_usual = not (write.peer.is_behind or word & RUN_BITS_OR_EDGES) and self.is_usual(write.host)
        return is_usual and self._ownership.admits(write.host) and not self._is_begun_anew(write.host)

    def is_usual(self, host: str) -> bool:
        """Return whether nothing makes a host's writes special: no bit that it held, no lowered setpoint, no run."""
        is_held = host in self.held_runs.by_host or self.held_enables.knows(host)
        return not (self.lowered_from_n or self.is_calibrating or is_held)

    # -- what the write asks for

    def _is_begun_anew(self, host: str, *, is_taken_over: bool = False) -> bool:
        """Whether a host goes on with what another one has left. Of a force that is held for a lost master nobody is the owner:
        who beats becomes it, and has asked for nothing by that."""
        owner, former = self._ownership.owner, self._ownership.former
        is_left = owner is None and former != host and bool(self._commands.values[CONTROL_WORD])
        return is_left or (is_taken_over and owner != host)

    def _permit(self, write: Write, values: Values, now_s: float) -> PermittedWrite | None:
        """Return what the owner may ask for, or anybody: a stop, the end of a run. None: nothing to stop. Raises Refusal."""
        commands = self._commands
        written, before = int(values[CONTROL_WORD]), int(commands.values[CONTROL_WORD])
        falls = before & ~written
        is_stop = bool(falls & ENABLE and not written & ~before & RUN_BITS)
        if not is_stop and self._is_named_stop(write, written):
            is_stop, written = True, written & ~RUN_BITS
        if self._ownership.admits(write.host) or (written & TAKE and self._ownership.may_take_over(write.host)):
            return PermittedWrite(values, written, is_stop)
        asks_for_more = written & (EDGE_BITS | STARTS & ~before)  # than a stop or the end of a run, as anybody may
        if is_stop and not asks_for_more:
            return PermittedWrite(commands.values.copy(), 0, True)
        if falls & RUN_BITS and not asks_for_more:
            return PermittedWrite(commands.values.copy(), before & ~RUN_BITS, False)
        if not written and tuple(self._offsets(write)) == (CONTROL_WORD,):
            return None
        raise self._not_owner(write.address, write.host)

    def _is_named_stop(self, write: Write, written: int) -> bool:
        """A run has no enable that could fall, nor any bit of it where this machine has begun it. Then enable written as 0 by
        its name, its coil say, is a stop whatever the run's bit is, and so is 0 in the control word alone. A cyclic block of
        zeros is none, nor is a row of coils that holds the run's bit at 1."""
        before = int(self._commands.values[CONTROL_WORD])
        if not (self.is_calibrating or before & RUN_BITS) or not write.touched & ENABLE:
            return False
        if written & (ENABLE | EDGE_BITS) or tuple(self._offsets(write)) != (CONTROL_WORD,):
            return False
        return not write.touched & RUN_BITS or not (written | before) & RUN_BITS

    def _sender(self, write: Write, *, is_guest: bool = False) -> tuple[str, Channel]:
        """Return who writes, and the channel of a heartbeat that is taken."""
        is_block = write.address == self._commands.first and len(write.data) > _BEHIND_HEARTBEAT  # the commonest
        brings_beat = not is_guest and (is_block or HEARTBEAT in self._offsets(write))
        return write.host, _channel(write) if brings_beat else NO_BEAT

    def _offsets(self, write: Write) -> range:
        """Return which words of the command block are written whole."""
        return self._commands.offsets(write.block, write.address, len(write.data) // 2)

    def _held_by(self, write: Write, written: int, asked: int) -> int:
        """Return the bits of a run that a master that writes in cycles holds at 1: only its own 0 lets the next 1 count.

        By another master's 0 behind the run, a Stop from the page say, the holder's next cycle would begin another run. Its
        own 0 counts, too, while another owns. asked: the control word as it came."""
        held = self.held_runs.of(write.host)
        if not held and not written & RUN_BITS:
            return 0
        if CONTROL_WORD not in self._offsets(write):
            return held
        if not self._ownership.admits(write.host):
            return held & (asked | ~write.touched)
        stands = held | int(self._commands.values[CONTROL_WORD])
        return held & ~write.touched | stands & written & write.touched & RUN_BITS

    def _is_in_use(self, host: str) -> bool:
        """Whether the output is this host's: it begins nothing then, and a beat that came with what was refused is one."""
        return self._ownership.owner == host and bool(int(self._commands.values[CONTROL_WORD]) & STARTS)

    def _frame(self, write: Write, heartbeat: int, word: int, *, tares: bool = False) -> StartFrame:
        beat = heartbeat if HEARTBEAT in self._offsets(write) else None
        return StartFrame(_channel(write), (write.address, write.data), beat, bool(word & TAKE), tares)

    def _note_refused(self, write: Write, reason: RefusalReason, now_s: float) -> None:
        """What was refused once, and is sent on and on, begins nothing later. A value that is refused today another calibration
        may allow, and of a bit that no rig has nobody asks whether it can ever become good: whoever corrects it brings another
        heartbeat, or writes 0. Nothing of it is taken but that its program goes on, and of who does not own which bits are kept
        at 1."""
        if reason is RefusalReason.BYTE_ORDER_UNPROVEN and not self.held_enables.has_beaten(write.host):
            return  # a person's own proof is waited for
        offsets, standing = self._offsets(write), int(self._commands.values[HEARTBEAT])
        frame, asks, word = StartFrame(_channel(write), (write.address, write.data)), CONTROL_WORD in offsets, ALL_BITS
        with suppress(Refusal):
            values = self._commands.decode(write.block, write.address, write.data)
            word = int(values[CONTROL_WORD]) if asks else 0
            frame, asks = self._frame(write, int(values[HEARTBEAT]), word), bool(word & (STARTS | TAKE))
        if frame.heartbeat is not None and not write.peer.is_behind:
            self.held_enables.on_refused_beat(now_s, frame.heartbeat, write.host, frame.channel)
        if reason is RefusalReason.NOT_OWNER and CONTROL_WORD in offsets:
            self.held_runs.keep(write.host, self._held_by(write, word, word))
            if write.touched & ~word & ENABLE:
                self.held_enables.let_go(write.host, now_s, asks=bool(word & _ASKING))
        if asks or (reason in _BUSY and frame.heartbeat is not None):
            self.held_enables.note_refused(write.host, frame, standing, now_s)
        elif frame.heartbeat is not None:
            self.held_enables.note_refused_beat(write.host, frame)
        if reason is RefusalReason.TARE_REFUSED:
            self.held_enables.note_refused(write.host, frame._replace(tares=True), standing, now_s)

    def _hear(self, write: Write, asked: int, heartbeat: int, now_s: float) -> None:
        offsets, enables = self._offsets(write), self.held_enables
        zeros = write.touched & ~asked if CONTROL_WORD in offsets else 0
        is_known = enables.knows(write.host)
        if HEARTBEAT in offsets:
            enables.hear(write.host, heartbeat, _channel(write))
        if is_known and zeros & ENABLE:
            enables.let_go(write.host, now_s, asks=bool(asked & _ASKING))
        if asked & TARE:
            enables.note_refused(write.host, self._frame(write, heartbeat, asked, tares=True), heartbeat, now_s)
        elif zeros & TARE:
            enables.let_go_tare(write.host)

    # -- why not

    def _ask(self, command: Command, values: Values, write: Write) -> None:
        refused = self.decide(ProposedWrite(command, lambda: self._changes(values)))
        if not refused:
            return
        if refused.reason is RefusalReason.FAULT_LATCHED and refused.bit & ENABLE:
            self.held_enables.note(write.host, command.received_s)
        if refused.reason is RefusalReason.HEARTBEAT_STALE and HEARTBEAT in self._offsets(write):
            self.held_enables.note_lost(write.host, command.heartbeat)
        if command.repeats and refused.reason is RefusalReason.HEARTBEAT_STALE:
            self._check_starts(command, self._commands.address(write.block, CONTROL_WORD))  # its own 0 comes first
        if not refused.bit:
            raise Refusal(refused.reason, write.address, refused.text)
        offsets = self._offsets(write)
        if CONTROL_WORD not in offsets:  # the bit stands: what was written beside it cannot be
            raise Refusal(refused.reason, write.address, refused.text, value=values[offsets.start])
        word_at = self._commands.address(write.block, CONTROL_WORD)
        raise Refusal(refused.reason, word_at, refused.text, value=float(command.control_word))

    def _changes(self, values: Values) -> tuple[str, ...]:
        before = self._commands.values
        return tuple(name for k, name in enumerate(NAMES) if values[k] != before[k] and k not in _SILENT)

    def _not_owner(self, address: int, host: str) -> Refusal:
        may_take_over = self._ownership.may_take_over(host)
        cure = "write control_word with bit 3 to take over" if may_take_over else "this rig names its owner"
        text = f"{self._ownership.owner} owns the setpoint, {host} may read and clear enable: {cure}"
        return Refusal(RefusalReason.NOT_OWNER, address, text)

    def _check_tare(self, command: Command, word_at: int, frame: StartFrame) -> None:
        if not int(command.control_word) & TARE:
            return
        if self.held_enables.repeats(command.peer, frame._replace(tares=True), command.received_s):
            text = f"tare refused: heartbeat = {command.heartbeat} as at its last one: write another value with it"
            raise Refusal(RefusalReason.HEARTBEAT_STALE, word_at, text, value=float(command.control_word))

    def _check_starts(self, command: Command, word_at: int) -> None:
        host, written = command.peer, int(command.control_word)
        rises = written & ~int(self._commands.values[CONTROL_WORD])
        if not rises & (STARTS | TAKE):
            return
        enables = rises | (written if written & TAKE else 0)  # who takes over goes on with what another one has enabled
        if enables & ENABLE and self.held_enables.holds(host, command.received_s):
            text = "enable was kept at 1 over a fault: write it as 0 once, then as 1"
            raise Refusal(RefusalReason.CALIBRATION_HELD, word_at, text, value=float(written))
        if held := rises & self.held_runs.of(host):
            name = str(ControlBit(held & -held).name).lower()
            text = f"{name} was kept at 1 beyond the end of its run: write it as 0 once, then as 1"
            raise Refusal(RefusalReason.CALIBRATION_HELD, word_at, text, value=float(written))
        if rises & STARTS and self._rules.require_byte_order_echo and not self._echo.is_proven_by(host):
            name = str(ControlBit(rises & STARTS & -(rises & STARTS)).name).lower()
            text = f"{name} refused: this rig wants 1234.5 in byte_order_echo first, in your client's word order"
            raise Refusal(RefusalReason.BYTE_ORDER_UNPROVEN, word_at, text, value=float(written))


def _channel(write: Write) -> Channel:
    return write.host, write.peer.host, write.peer.port, write.address, len(write.data)
