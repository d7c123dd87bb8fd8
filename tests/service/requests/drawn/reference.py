"""What a running gateway may answer to a request, said once more from the documented rules: role, block, access, value, owner.

Shares no code with the gateway. What the state of the machine decides besides (an edge of the control word, a run, what is
held for a lost master) it leaves open: then one of several answers is right.
"""

from dataclasses import dataclass, field
from math import inf

from tests.fuzz.bank_model import ENABLE, FACES, MOMENTARY, SHAPES, BankModel, Refused, Words, single

SETPOINT, CALIBRATION = 1, 2
"""Roles, from monitor (0) to admin (3)."""
RUNS, TAKE, PULL = 32 | 64, 8, 16
HEARTBEAT = 4
CALIBRATING = 5
WRITES = 5, 6, 15, 16, 22, 23
OK, BY_STATE = frozenset((0,)), frozenset((0, 3, 4, 6))
STAGING, STAGING_READ_ONLY = (1000, 1199), (1146, 1147, 1148)
UNITS = 0, 1, 255
FORCE, PAYLOAD, MOST_PAYLOAD_G = 1, 9, 10000
VOLTAGE, MOST_MV = 5, 8500
"""As the rig has it: the range of its cell is 98.07 N."""


@dataclass
class Before:
    """What registers and owner have told before the request. values: of the command block, in the registers' units;
    most_pull_n: as the model in use has it."""

    values: list[float]
    owner: str | None
    state: int
    most_pull_n: float = inf


@dataclass
class Verdict:
    """codes: exceptions that are right, 0 for none. values: of the command block behind it, None where the state decides.
    written: control word as this request has it, None where it writes none. is_remembered: even where it is refused: a start,
    lest it is taken when what it was refused for is over, and a heartbeat, lest it counts once more as a new one."""

    codes: frozenset[int]
    values: list[float] | None = None
    written: int | None = None
    is_write: bool = False
    is_remembered: bool = False


@dataclass
class RunningReference(BankModel):
    """role: of who asks."""

    role: int = 0
    state: int = 0
    most_pull_n: float = inf
    written: int | None = None
    is_open: bool = field(default=False)
    is_remembered: bool = field(default=False)

    def write(self, address: int, words: Words, host: str) -> None:
        self.check_address(address, len(words))
        if not self._is_writable(address, len(words)):
            raise Refused(2)
        if self.role < SETPOINT:
            raise Refused(1)
        base = 0 if address < 100 else address // 100 * 100
        places = self._covers(base, address - base, len(words))
        self.is_remembered = base in (0, *FACES) and (0 in places or HEARTBEAT in places)
        super().write(address, words, host)

    def _write_or_skip(self, address: int, words: Words, host: str) -> int | None:
        if not STAGING[0] <= address <= STAGING[1]:
            return super()._write_or_skip(address, words, host)
        self.check_address(address, len(words))
        if any(place in STAGING_READ_ONLY for place in range(address, address + len(words))):
            raise Refused(2)
        if self.role < CALIBRATION:
            raise Refused(1)
        return None

    def _admit(self, changed: list[float], covers: range, host: str) -> None:
        if changed[PAYLOAD] > MOST_PAYLOAD_G or changed[VOLTAGE] > MOST_MV:
            raise Refused(3)
        word, before = int(changed[0]), int(self.values[0])
        self.written = word if 0 in covers else None
        rises, force_n = word & ~before, self.values[FORCE]
        if (word | before) & RUNS or self.state == CALIBRATING:
            self.is_open = True  # a run: only its end is granted to everybody
            return
        is_own = self.owner in (None, host) or bool(word & TAKE)
        super()._admit(changed, covers, host)
        self.is_open = is_own and bool(rises & ~MOMENTARY or word & MOMENTARY)
        asked_n = self.values[FORCE] if int(self.values[0]) & PULL else 0.0
        if not self.is_open and asked_n != force_n and asked_n > self.most_pull_n:
            raise Refused(3)


def judge(pdu: bytes, role: int, host: str, before: Before, known_bits: int) -> Verdict:
    """Return what is right for one request to a unit that is served."""
    is_write = bool(pdu) and pdu[0] in WRITES
    if pdu[0] in (8, 17, 43):
        return Verdict(frozenset((_without_registers(pdu),)))
    reference = RunningReference(
        list(before.values),
        before.owner,
        known_bits=known_bits,
        role=role,
        state=before.state,
        most_pull_n=before.most_pull_n,
    )
    code = reference.answer(pdu, host)
    if code is None:
        return Verdict(BY_STATE, is_write=True)
    if code:
        return Verdict(frozenset((code,)), is_write=is_write, is_remembered=reference.is_remembered)
    codes = BY_STATE if reference.is_open else OK
    keeps_values = is_write and not (reference.is_open and (reference.written or 0) & (RUNS | TAKE | ENABLE))
    values = [single(value) for value in reference.values] if keeps_values and before.state != CALIBRATING else None
    return Verdict(codes, values, reference.written, is_write, reference.is_remembered)


def when_lost(values: list[float]) -> list[float]:
    """Return what the end of its lease leaves of an owner's command block."""
    return [0.0 if k in (0, FORCE, VOLTAGE) else value for k, value in enumerate(values)]


def is_whole(pdu: bytes) -> bool:
    """Decide whether a request has the shape of its function: on a bus nothing else tells where it ends."""
    if pdu[0] in (8, 17, 43):
        return _without_registers(pdu) != 3
    return pdu[0] in SHAPES and SHAPES[pdu[0]](pdu)


def _without_registers(pdu: bytes) -> int:
    """Diagnostics, identity and name of the device."""
    if pdu[0] == 17:
        return 3 if len(pdu) != 1 else 0
    if pdu[0] == 8:
        if len(pdu) < 3 or len(pdu) % 2 == 0:
            return 3
        return 0 if pdu[1:3] == b"\0\0" else 1
    if len(pdu) > 1 and pdu[1] != 14:
        return 1
    if len(pdu) != 4 or not 1 <= pdu[2] <= 4:
        return 3
    return 2 if pdu[2] == 4 and pdu[3] > 6 else 0
