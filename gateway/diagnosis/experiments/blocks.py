"""Building blocks of experiments: what a gateway can put out by itself to make effects show, as parts of a plan.

Levels are shares of what the rig may use (with the shipped rig about 0 .. 8 V, 0 .. 58 N). A block begins with its own
step or ramp, so blocks may follow each other in any order; what two effects share is run once.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import Final

from gateway.catalogue.effect import PartName
from gateway.control.runs.experiment_plan import Move, MoveKind, Part

LEVELS: Final = (0.2, 0.45, 0.75)


def _step(level: float, hold_s: float) -> Move:
    return Move(do=MoveKind.STEP, to_share=round(level, 4), hold_s=hold_s)


def _ramp(level: float, over_s: float, hold_s: float = 0.5) -> Move:
    return Move(do=MoveKind.RAMP, to_share=round(level, 4), over_s=over_s, hold_s=hold_s)


def _ladder(level: float, stairs: int, hold_s: float) -> Move:
    return Move(do=MoveKind.LADDER, to_share=round(level, 4), stairs=stairs, hold_s=hold_s)


def _swing(size: float, times: int, over_s: float | None, hold_s: float | None = None) -> Move:
    return Move(do=MoveKind.REVERSALS, size_share=size, times=times, over_s=over_s and round(over_s, 3), hold_s=hold_s)


def _dwells() -> Iterator[Move]:
    for level in (0.3, 0.6, 0.9, 0.6, 0.3):
        yield _step(level, 6.0)


def _reversals(sizes: Sequence[float], over_s: float) -> Iterator[Move]:
    """Of each size around each of three levels; the first swings come as evenly as all others."""
    for level in LEVELS:
        yield _ramp(level, 1.0)
        for size in sizes:
            yield _swing(size, 2, over_s * max(0.25, (size / max(sizes)) ** 0.5))


def _steps() -> Iterator[Move]:
    yield _step(0.45, 1.2)
    for size in (0.06, 0.12, 0.25, 0.5):
        yield _swing(size, 2, None, 1.2)


def _ramps() -> Iterator[Move]:
    yield _step(0.15, 1.0)
    for over_s in (12.0, 3.0, 0.75):
        for _ in range(1 if over_s > 5.0 else 2):
            yield _ramp(0.75, over_s)
            yield _ramp(0.15, over_s)


def _fine() -> Iterator[Move]:
    for level in LEVELS:
        yield _step(level, 1.0)
        yield _ladder(level + 0.03, 12, 0.25)
        yield _ladder(level - 0.03, 24, 0.25)
        yield _ladder(level, 12, 0.25)


def _rests() -> Iterator[Move]:
    """Rests of different length, each followed by the same slow ramp, there and back."""
    yield _step(0.3, 1.0)
    for k, rest_s in enumerate((0.5, 10.0, 2.0, 20.0, 5.0, 1.0)):
        yield Move(do=MoveKind.DWELL, hold_s=rest_s)
        yield _ramp(0.3 if k % 2 else 0.6, 3.0, 0.0)


def _touches() -> Iterator[Move]:
    for _ in range(2):
        yield _step(0.0, 1.5)
        yield _ladder(0.16, 16, 0.4)
        yield _ladder(0.0, 16, 0.4)


def _cycles(high: float, hold_s: float, times: int) -> Iterator[Move]:
    for _ in range(times):
        yield _step(high, hold_s)
        yield _step(0.15, hold_s)


_BLOCKS: Final[dict[PartName, tuple[str, Iterable[Move]]]] = {
    PartName.STAIRCASE: ("all levels, from both sides", (_ladder(1.0, 20, 0.6), _ladder(0.0, 20, 0.6))),
    PartName.DWELLS: ("levels held long enough for leaks, creep and oscillation to show", _dwells()),
    PartName.REVERSALS: (
        "loops of three sizes around three levels: the shape of friction",
        _reversals((0.02, 0.08, 0.25), 1.2),
    ),
    PartName.STEPS: ("steps of four sizes: delay, lags and limits of speed part", _steps()),
    PartName.RAMPS: ("the same way at three speeds: what depends on speed", _ramps()),
    PartName.FINE: ("stairs as small as a dead band, up and down around three levels", _fine()),
    PartName.RESTS: ("rests of six lengths, each followed by the same ramp", _rests()),
    PartName.STROKES: (
        "nearly the whole range, four times",
        (_ramp(0.5, 2.0), _swing(0.9, 4, 3.0, 0.3), _ramp(0.05, 1.0)),
    ),
    PartName.SLOW_RAMP: (
        "so slow that each step of the command stands alone",
        (_step(0.25, 1.0), _ramp(0.5, 40.0), _ramp(0.25, 40.0)),
    ),
    PartName.TOUCHES: ("from no force to a little and back: play, lost force and signs", _touches()),
    PartName.CYCLES: ("30 s at a high and at a low level, three times", _cycles(0.75, 30.0, 3)),
    PartName.LASTING: ("the same steps from beginning to end", (_step(0.45, 2.0), _swing(0.4, 60, None, 2.5))),
    PartName.REST: ("no force: what the cell and its cable say by themselves", (_step(0.0, 20.0),)),
    PartName.LONG_REST: ("ten minutes without force", (_step(0.0, 600.0),)),
    PartName.LEVEL: ("one force for as long as what is moved by hand takes", (_step(0.45, 60.0),)),
    PartName.THREE_LEVELS: ("20 s at each of three forces", (_step(level, 20.0) for level in LEVELS)),
}
BLOCKS: Final[dict[PartName, Part]] = {
    name: Part(name=str(name), why=why, moves=tuple(moves)) for name, (why, moves) in _BLOCKS.items()
}
"""Every part that a recipe of the catalogue may name, ready to run."""
