"""Programs of masters as a seed draws them: what frames they write, how their heartbeat goes, by which connections."""

from collections.abc import Callable, Mapping
from random import Random
from struct import pack

from gateway.codes.refusals import RefusalReason
from gateway.modbus import Peer
from gateway.registers import Refusal
from tests.service.running_rig.simulated_rig import (
    CALIBRATE,
    ENABLE,
    MAP,
    RESET,
    SELF_TEST,
    TAKE,
    TARE,
    VALVE,
    SmallRig,
)

Frame = Callable[[SmallRig, Peer, int, int, int], None]
"""Writes with a control word, a setpoint in counts and a heartbeat."""
KNOWN = ENABLE | RESET | TARE | TAKE | VALVE | CALIBRATE | SELF_TEST
BITS = range(16)
CERTIFICATES = {"plc": ("10.0.0.7", "10.0.0.8"), "robot": ("10.0.0.7",)}
"""Names, and by which addresses each comes."""


def words_frame(address: int, *names: str) -> Frame:
    def write(rig: SmallRig, peer: Peer, word: int, force: int, beat: int) -> None:
        told = {"word": word, "force": force, "beat": beat, "": 0}
        rig.write(address, *(told[name] for name in names), peer=peer)

    return write


def floats_frame(address: int, *names: str) -> Frame:
    def write(rig: SmallRig, peer: Peer, word: int, force: int, beat: int) -> None:
        told = {"word": word, "force": force / 100, "beat": beat, "": 0}
        rig.bank.write_registers(address, pack(f">{len(names)}f", *(told[name] for name in names)), peer)

    return write


def _coils(rig: SmallRig, peer: Peer, word: int, force: int, beat: int) -> None:
    rig.bank.write_bits(0, [bool(word >> bit & 1) for bit in range(7)], peer)


def _each_coil(rig: SmallRig, peer: Peer, word: int, force: int, beat: int) -> None:
    for bit in reversed(BITS):  # a takeover first
        if bit == 0 or word >> bit & 1:
            rig.bank.write_bits(bit, [bool(word >> bit & 1)], peer)


def write_mask(rig: SmallRig, peer: Peer, word: int, force: int, beat: int) -> None:
    rig.bank.mask_write(0, 0xFFFF & ~KNOWN, word & KNOWN, peer)


def _read_and_write(rig: SmallRig, peer: Peer, word: int, force: int, beat: int) -> None:
    rig.bank.check_registers_readable(100, 8, peer)
    rig.write(0, word, force, 0, 0, beat, 0, peer=peer)
    rig.bank.read_registers(100, 8, peer)


_BLOCK = words_frame(0, "word", "force", "", "", "beat")
WORD_AND_FORCE, _FLOATS = words_frame(0, "word", "force"), floats_frame(200, "word", "force")
BEAT, WORD, FORCE = words_frame(4, "beat"), words_frame(0, "word"), words_frame(1, "force")
FORCE_AND_BEAT = words_frame(1, "force", "", "", "beat")
PROOF_AT = MAP.find("byte_order_echo").address
SPELLINGS: dict[str, tuple[Frame, ...]] = {
    "block": (_BLOCK,),
    "block, beat": (_BLOCK, BEAT),
    "beat, block": (BEAT, _BLOCK),
    "word and force, beat": (WORD_AND_FORCE, BEAT),
    "force, word, beat": (FORCE, WORD, BEAT),
    "beat, force, word": (BEAT, FORCE, WORD),
    "word, force, beat": (WORD, FORCE, BEAT),
    "force and beat, word": (FORCE_AND_BEAT, WORD),
    "floats": (floats_frame(200, "word", "force", "", "", "beat"),),
    "float force and beat, word": (floats_frame(202, "force", "", "", "beat"), WORD),
    "floats, beat": (_FLOATS, BEAT),
    "force and beat, coils": (FORCE_AND_BEAT, _coils),
    "force and beat, coil": (FORCE_AND_BEAT, _each_coil),
    "mask, force and beat": (write_mask, FORCE_AND_BEAT),
    "read and write": (_read_and_write,),
}

RUN_COIL_AND_ENABLE_COIL = _each_coil
"""Without enable its last one ends what the others have begun."""
SILENT = {WORD, FORCE, _coils, _each_coil, write_mask, WORD_AND_FORCE, _FLOATS}
"""Frames without a heartbeat."""
WORD_ALONE = {WORD, _coils, _each_coil, write_mask}
"""Frames of the control word, by whichever function: the same bytes."""


def zeros_by_each_function(rig: SmallRig, peer: Peer) -> dict[str, Callable[[], None]]:
    """Ways of writing enable as 0."""
    return {
        "FC06": lambda: rig.write(0, 0, peer=peer),
        "FC05": lambda: rig.bank.write_bits(0, [False], peer),
        "FC15": lambda: rig.bank.write_bits(0, [False] * 7, peer),
        "FC22": lambda: rig.bank.mask_write(0, 0, 0, peer),
        "FC16": lambda: rig.write(0, 0, 0, peer=peer),
        "floats": lambda: rig.bank.write_registers(200, pack(">2f", 0, 0), peer),
        "block": lambda: rig.write(0, 0, 0, 0, 0, 0, peer=peer),
    }


def is_serial(host: str) -> bool:
    """Whether a host is all masters of a serial face, which have no connection."""
    return host.startswith("serial")


ZEROS = 0, 0
WAITING = -1


class Program:
    """Writes its frames in each cycle. asks: control word and force of this cycle, None while it is idle; wants: what it goes
    for; is_live: its heartbeat moves, and it does as it is told; else all that it writes stays as it is."""

    def __init__(
        self, draw: Random, host: str, place: int, spellings: Mapping[str, tuple[Frame, ...]] = SPELLINGS
    ) -> None:
        self._draw, self._host = draw, host
        self.spelling = draw.choice(tuple(spellings))
        self.frames = spellings[self.spelling]
        self.period = draw.choice((2, 3, 5, 5, 10, 10, 20, 50))
        self._due, self._gap, self._at, self._next = draw.randrange(self.period), draw.choice((0, 0, 1)), WAITING, 0
        self._counts, self._beat = host in CERTIFICATES or draw.random() < 0.7, draw.randrange(1, 65000)
        self._sent_beat = self._beat
        self._connects = draw.choice(("once", "once", "each frame", "each cycle", "now and then"))
        if not self._counts:
            self._connects = "once"  # behind a restart nobody can tell it from two that hung
        self._port = 5000 + 1000 * place
        if is_serial(host):
            self._connects, self._port = "once", 0
        self.is_live, self.pools = True, False
        self.wants: tuple[int, int] | None = None
        self.asks: tuple[int, int] | None = None
        self._rests = draw.choice((None, ZEROS))
        self.takes_if_told, self.resets = draw.random() < 0.6, draw.random() < 0.5
        self.refused: list[RefusalReason] = []
        self.beat_at, self.is_stale = 0, False
        self.stale = self.held = self.cycles = 0

    @property
    def may_pool(self) -> bool:
        """Whether two connections may take turns: not where each brings one of two values, as two programs that hung would."""
        return self._connects == "once" and self._counts and not is_serial(self._host)

    def begin_anew(self) -> None:
        """Forget what it was told."""
        self.stale = self.held = self.cycles = 0
        self.refused, self.is_stale = [], False

    def __str__(self) -> str:
        return (
            f"{self.identity} {self.spelling} /{self.period} {self._connects} {'counts' if self._counts else 'toggles'}"
        )

    def is_like(self, other: "Program") -> bool:
        """Whether frames of the two, on one host, are told apart by nothing but their connection."""
        shared = set(self.frames) & set(other.frames) - {WORD, FORCE}
        return bool(shared)

    def is_mistaken_for(self, other: "Program") -> bool:
        """Whether words of the two, on one host, are told apart by nothing, for a connection is new."""
        is_lasting = self._connects == other._connects == "once"
        return not is_lasting and any(
            alike & {*self.frames} and alike & {*other.frames} for alike in (WORD_ALONE, {FORCE})
        )

    @property
    def identity(self) -> str:
        return f"certificate {self._host}" if self._host in CERTIFICATES else self._host

    def peer(self) -> Peer:
        """By which connection the next frame comes."""
        self._port += self._connects == "each frame" or (self._connects == "now and then" and self._draw.random() < 0.1)
        port = self._port + self._draw.choice((0, 500)) if self.pools else self._port
        if self._host in CERTIFICATES:
            return Peer(self._draw.choice(CERTIFICATES[self._host]), port, name=self._host)
        return Peer(self._host, port)

    def note_beat(self, frame: Frame) -> bool:
        """Note what a frame brings; return whether its heartbeat comes for the first time: it may have moved before."""
        is_new = frame not in SILENT and self._beat != self._sent_beat
        if is_new:
            self._sent_beat = self._beat
        return is_new

    def due(self, tick: int) -> list[Frame]:
        """Return the frames that are sent at this tick."""
        if self._at == WAITING and tick >= self._due:
            self._due, self._at, self._next = tick + self.period, 0, tick
            self._begin()
        if self.asks is None:
            self._at = WAITING
        if self._at == WAITING or tick < self._next:
            return []
        count = 1 if self._gap else len(self.frames)
        frames, self._next = self.frames[self._at : self._at + count], tick + 1
        self._at += count
        if self._at >= len(self.frames):
            self._at = WAITING
        return list(frames)

    def _begin(self) -> None:
        self._port += self._connects == "each cycle"
        if not self.is_live:
            return
        before, refused, self.refused = self.asks, self.refused, []
        self.stale, self.is_stale = self.stale + 1 if self.is_stale else 0, False
        self.held = self.held + 1 if RefusalReason.CALIBRATION_HELD in refused else self.held
        self.cycles += 1
        self.asks = self._obeyed(before, refused) if self.wants else self._rests
        if before and before != self.asks and self.asks is None:
            self.asks = ZEROS  # once, before it rests
        if self.asks:
            self._beat = (self._beat + 1) % 65536 if self._counts else 1 - min(self._beat, 1)

    def _obeyed(self, before: tuple[int, int] | None, refused: list[RefusalReason]) -> tuple[int, int] | None:
        assert self.wants
        if before and not refused:
            self.held = 0
        if RefusalReason.CALIBRATION_HELD in refused:
            return ZEROS
        if before and before[0] & RESET and RefusalReason.NOT_OWNER in refused and self.takes_if_told:
            return RESET | TAKE, 0
        if RefusalReason.RESET_NEEDS_ZERO in refused or (RefusalReason.FAULT_LATCHED in refused and self.resets):
            return RESET, 0
        if RefusalReason.NOT_OWNER in refused and self.takes_if_told:
            return self.wants[0] | TAKE, self.wants[1]
        return self.wants

    def write(self, rig: SmallRig, frame: Frame, peer: Peer, number: int, stopped_at: int) -> Refusal | None:
        """Send a frame, and the proof of the byte order where that is told. number: of this write; stopped_at: of the last one
        by which another host has switched the output off."""
        assert self.asks
        if frame not in SILENT:
            self.beat_at = number
        try:
            frame(rig, peer, *self.asks, self._beat)
        except Refusal as refusal:
            self.refused.append(refusal.reason)
            self.is_stale |= refusal.reason is RefusalReason.HEARTBEAT_STALE and stopped_at < self.beat_at
            if refusal.reason is RefusalReason.BYTE_ORDER_UNPROVEN and self.is_live:
                rig.bank.write_registers(PROOF_AT, pack(">f", 1234.5), peer)
            return refusal
        return None
