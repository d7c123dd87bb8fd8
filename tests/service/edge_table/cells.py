"""The cells of the table: each way in which a master may write each control word, and what the rig makes of it."""

from collections.abc import Iterator
from dataclasses import dataclass
from struct import pack
from typing import Final

from gateway.modbus import ModbusError
from gateway.registers import Refusal
from gateway.registers.writes.admission import Write
from gateway.registers.writes.frame_beats import FrameBeats
from tests.service.edge_table.rules import Asked
from tests.service.running_rig.simulated_rig import OWNER, SmallRig

WORDS: Final = range(128)
FORCES_N: Final = (0.0, 13.0)
BEAT: Final = 4711
_FIELDS: Final = {2: 77.7, 3: 1, 5: 1500, 6: 10.0, 7: 3.3, 8: 400, 9: 250, 11: 0.7, 12: 150}
"""Offset of each register beside control word, setpoint, heartbeat and sequence: a value that none has by itself."""
_COUNTS: Final = {1: 100, 2: 10, 6: 10, 7: 100, 11: 100}
_BASES: Final = {"command": 0, "float_abcd": 200, "float_cdab": 300}


@dataclass(frozen=True)
class Cell:
    """block: the face; offset: of the first value; values: in the registers' units. coils: bits in place of registers."""

    block: str
    offset: int
    values: tuple[float, ...]
    asked: Asked

    @property
    def address(self) -> int:
        """Return where the write begins, and where its refusal points to."""
        base = _BASES.get(self.block, 0)
        return base + self.offset * (2 if base else 1)

    @property
    def data(self) -> bytes:
        """Return the words of the write."""
        if self.block == "command":
            counts = [round(value * _COUNTS.get(self.offset + k, 1)) for k, value in enumerate(self.values)]
            return pack(f">{len(counts)}H", *(count & 0xFFFF for count in counts))
        floats = [pack(">f", value) for value in self.values]
        return b"".join(one if self.block == "float_abcd" else one[2:] + one[:2] for one in floats)

    def write(self, rig: SmallRig) -> Refusal | None:
        """Write as the owner; the refusal, where it is one."""
        _forget_others(rig)
        try:
            if self.block == "coils":
                rig.bank.write_bits(0, [bool(int(self.values[0]) >> k & 1) for k in range(7)], OWNER)
            else:
                rig.bank.write_registers(self.address, self.data, OWNER)
        except ModbusError as error:
            assert isinstance(error, Refusal)
            return error
        return None

    def outcome(self, rig: SmallRig) -> object:
        """What the bank would store and hand on, without doing it: equal ones have one future. Raises Refusal."""
        _forget_others(rig)
        name = "command" if self.block == "coils" else self.block
        block = next(one for one in rig.bank._map.blocks if one.name == name)
        data = pack(">H", int(self.values[0])) if self.block == "coils" else self.data
        touched = 0x7F if self.block == "coils" else 0xFFFF
        admitted = rig.bank._admission.admit(
            Write(block, self.address, data, OWNER.identity, OWNER, touched), rig.bank.command.number + 1, rig.now()
        )
        assert admitted is not None
        return (tuple(round(value, 4) for value in admitted.values[:13]), *admitted[1:2], admitted.command.control_word,
                *admitted[3:])  # fmt: skip


def _forget_others(rig: SmallRig) -> None:
    """No other cell's write was before this one."""
    rig.bank.held_enables.let_go(OWNER.identity, rig.now())
    rig.bank.held_enables._refused.clear()
    rig.controller._commands._lease._frames = FrameBeats()  # a heartbeat that was refused is no new one behind that


def cells(stands_n: float) -> Iterator[Cell]:
    """Every control word by every face, alone, with a setpoint, and in a cyclic master's whole block; then every other register
    alone. stands_n: the setpoint in use, which a whole block repeats."""
    for word in WORDS:
        for block in ("command", "float_abcd", "float_cdab", "coils"):
            yield Cell(block, 0, (word,), Asked(word))
        for block in _BASES:
            for force_n in FORCES_N:
                yield Cell(block, 0, (word, force_n), Asked(word, force_n))
            whole = (word, stands_n, 0, 0, BEAT, *(0,) * 8)
            yield Cell(block, 0, whole, Asked(word, stands_n, beats=True))
    for block in _BASES:
        for force_n in FORCES_N:
            yield Cell(block, 1, (force_n,), Asked(force_n=force_n))
        for offset, value in _FIELDS.items():
            yield Cell(block, offset, (value,), Asked(changes=True))
        yield Cell(block, 4, (BEAT,), Asked(beats=True))
        yield Cell(block, 10, (BEAT,), Asked())
