"""Wrong units and swapped columns, looked for before any cause: what no search for causes can make good.

The start plant is played over the recording as it is, and where its force is not the measured one times about 1, over the
same recording with columns exchanged, turned or in other units. What makes them agree is told, with the factor seen. Against
a plant that belongs to the recording's rig a factor is proof enough; a foreign machine may be of another size: there a
unit is only asked for. Signs, exchanged columns and numbers beyond what any regulator gives are sure in either case; of
such a recording no cause is named.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import inf, log
from typing import Final

import numpy as np

from gateway.diagnosis.bench.recording_drive import SETTLING_S, drive_of
from gateway.diagnosis.measurement import Floats, Measurement
from gateway.twin.plant import Plant, with_value
from gateway.twin.replay.replay import Replay
from gateway.units import LINEAR

UNIT: Final = "E520"
SWAPPED: Final = "E521"
TURNED: Final = "E522"
_USUAL: Final = {True: log(1.7), False: log(3.0)}  # |log gain| of a machine as it is, by whether its plant is known
_NEAR: Final = {True: log(1.35), False: log(1.3)}  # of a unit's own factor
_ALIKE: Final = 0.7  # correlation that a hypothesis must reach
_BETTER: Final = 0.3  # of the unexplained share: another order of the columns must leave less
_BEYOND: Final = 1.35  # times the full scale
_LEAST_MOVE: Final = 0.03  # of the regulator's full scale that the drive must move
_COARSE_S: Final = 1.0  # between two rows a force has followed its command: times in ms look like that
_ROWS: Final = 4000  # are enough to see a factor


@dataclass(frozen=True, slots=True)
class Suspect:
    """A column that is probably not what its name says."""

    code: str
    recording: str
    column: str
    factor: float  # of `what` over what the plant gives for one of the drive's numbers
    unit: str = ""  # probably of the column; `-n`: a turned sign, empty: exchanged columns
    other: str = ""
    is_sure: bool = True  # no cause is looked for
    what: str = "the force"  # or a pressure beside a command
    against: str = ""
    option: str = ""  # what corrects it, as --columns has it

    @property
    def mapping(self) -> dict[str, str]:
        """Columns as --columns has to name them: SOURCE[:UNIT] by name, with headers as they are."""
        if self.other:
            return {self.column: self.other, self.other: self.column}
        return {self.column: f"{self.column}:{self.unit}"}

    @property
    def sentence(self) -> str:
        """Sentence that says what was seen, what it probably is, and what corrects it."""
        return f"{self._seen}; {self.option} corrects it" if self.option else self._seen

    @property
    def _seen(self) -> str:
        if self.column == "time_s":
            return f"{self.code} {self.recording}: one row every {self.factor:.3g} s: time_s is probably in {self.unit}"
        seen = f"{self.code} {self.recording}: {self.what} is {self.factor:.3g} times what {self.against} gives for its drive"
        if self.code == SWAPPED:
            return f"{seen}; with {self.column} and {self.other} exchanged they agree: the two columns are swapped"
        if self.code == TURNED:
            return (
                f"{seen}: it falls where it should rise. The cell's sign is turned, or a pull was counted as positive"
            )
        doubt = "" if self.is_sure else ", unless this is a machine of another size"
        return f"{seen}: {self.column} is probably in {self.unit}{doubt}"


@dataclass(frozen=True, slots=True)
class _ColumnFit:
    """Measured = gain x simulated + offset; alike: their correlation, with its sign."""

    gain: float
    alike: float

    @property
    def unexplained(self) -> float:
        return 1.0 - self.alike**2

    def off(self, factor: float = 1.0) -> float:
        """Return |log| of the gain against a factor; infinite for a gain that is none."""
        return abs(log(self.gain / factor)) if self.gain > 0.0 else inf


def find_suspects(measurements: Sequence[Measurement], plant: Plant, *, is_own: bool) -> tuple[Suspect, ...]:
    """Return at most one for each recording, None for those that are as they should be. is_own: the plant is the recording's
    rig's."""
    against = "the rig's plant" if is_own else "the start plant"
    found = (_suspect(_thin(each), plant, is_own) for each in measurements)
    return tuple(replace(each, against=against) for each in found if each is not None)


def _suspect(measurement: Measurement, plant: Plant, is_own: bool) -> Suspect | None:
    row_s = float(np.median(np.diff(measurement.time_s)))
    if row_s >= _COARSE_S:
        return Suspect(UNIT, measurement.name, "time_s", row_s, "ms", is_sure=False)
    if not _moves(measurement):
        return None
    as_is = _fit(measurement, plant)
    too_large = set(_beyond(measurement, plant))
    too_large -= {"pressure_kpa"} if measurement.command_v is not None else set()
    if as_is.alike > _ALIKE and as_is.off() < _USUAL[is_own] and not too_large:
        return _beside(measurement, plant)
    best = min(_explanations(measurement, plant, as_is, is_own), key=lambda each: each[0], default=None)
    if best is None:
        return None
    return replace(best[1], recording=measurement.name, factor=best[1].factor or as_is.gain)


def _explanations(
    measurement: Measurement, plant: Plant, as_is: _ColumnFit, is_own: bool
) -> Iterator[tuple[float, Suspect]]:
    """(how far off it leaves the force, what it would be), for everything that explains the recording."""
    if as_is.alike < -_ALIKE:
        yield 0.0, Suspect(TURNED, "", "force_n", 0.0, "-n")
    for column, other in _EXCHANGES:
        exchanged = _exchange_columns(measurement, column, other)
        if exchanged is not None and _moves(exchanged) and not _beyond(exchanged, plant):
            fit = _fit(exchanged, plant)
            is_better = fit.unexplained < _BETTER * as_is.unexplained or bool(_beyond(measurement, plant))
            if fit.alike > _ALIKE and is_better and fit.off() < _USUAL[is_own]:
                yield fit.off(), Suspect(SWAPPED, "", column, 0.0, other=other)
    for column, quantity in (("force_n", "force"), ("command_v", "voltage"), ("pressure_kpa", "pressure")):
        own = column.rpartition("_")[2]
        for unit in _other_units(quantity, own):
            factor = LINEAR[quantity][unit][0] / LINEAR[quantity][own][0]
            converted = _convert_column(measurement, column, factor)
            if converted is None or _beyond(converted, plant) or not _moves(converted):
                continue
            fit = _fit(converted, plant)
            if fit.alike > _ALIKE and fit.off() < _NEAR[is_own]:
                was_beyond = column in _beyond(measurement, plant)
                rarity = 0.0 if was_beyond or unit in _COMMON else 0.1
                times = fit.gain / factor if column == "force_n" else fit.gain * factor
                yield fit.off() + rarity, Suspect(UNIT, "", column, times, unit, is_sure=is_own or was_beyond)


def _beside(measurement: Measurement, plant: Plant) -> Suspect | None:
    """A pressure beside the command in another unit: a transducer has a gain of its own, so causes are looked for anyway."""
    pressure_pa = measurement.pressure_pa
    if measurement.command_v is None or pressure_pa is None:
        return None
    simulated_pa = Replay(drive_of(replace(measurement, position_m=None), "inferred")).run([plant]).pressure_pa[0]
    fit = _regression(simulated_pa, pressure_pa)
    for unit in _other_units("pressure", "kpa"):
        factor = LINEAR["pressure"][unit][0] / LINEAR["pressure"]["kpa"][0]
        if fit.alike > _ALIKE and fit.off(1.0 / factor) < _NEAR[False]:
            return Suspect(
                UNIT, measurement.name, "pressure_kpa", fit.gain, unit, is_sure=False, what="the measured pressure"
            )
    return None


_EXCHANGES: Final = (("command_v", "force_n"), ("pressure_kpa", "force_n"), ("command_v", "pressure_kpa"))
_COMMON: Final = ("kgf", "mn", "bar", "mv", "psi", "mpa", "pa")


def _other_units(quantity: str, own: str) -> Iterator[str]:
    """Every unit that a column may have been written in instead of its own."""
    return (unit for unit in LINEAR[quantity] if unit != own)


def _thin(measurement: Measurement) -> Measurement:
    """The first minutes of a long recording, all of a usual one."""
    if measurement.rows <= 3 * _ROWS:
        return measurement
    rows = slice(0, 3 * _ROWS)

    def cut(column: Floats | None) -> Floats | None:
        return None if column is None else column[rows]

    return replace(
        measurement,
        time_s=measurement.time_s[rows],
        force_n=measurement.force_n[rows],
        usable=measurement.usable[rows],
        repeated=measurement.repeated[rows],
        command_v=cut(measurement.command_v),
        pressure_pa=cut(measurement.pressure_pa),
        position_m=None,
        covariates={},
    )


def _moves(measurement: Measurement) -> bool:
    """Does the drive move at all, by what its numbers say or by their own range where they say too little?"""
    drive = measurement.command_v if measurement.command_v is not None else measurement.pressure_pa
    if drive is None or measurement.usable.sum() < 50:
        return False
    force_n = measurement.force_n[measurement.usable]
    spread = float(np.ptp(drive)) > _LEAST_MOVE * max(float(np.abs(drive).max()), 1.0e-12)
    return spread and float(np.ptp(force_n)) > 0.0


def _beyond(measurement: Measurement, plant: Plant) -> tuple[str, ...]:
    """Columns whose numbers no such machine gives."""
    regulator = plant.regulator
    most_n = plant.cylinder.area_m2 * regulator.full_scale_pa * 4.0
    found = []
    if measurement.command_v is not None and float(measurement.command_v.max()) > _BEYOND * regulator.full_scale_v:
        found.append("command_v")
    if measurement.pressure_pa is not None and float(measurement.pressure_pa.max()) > _BEYOND * 1.0e6:
        found.append("pressure_kpa")
    if float(np.quantile(np.abs(measurement.force_n[measurement.usable]), 0.99)) > most_n:
        found.append("force_n")
    return tuple(found)


def _fit(measurement: Measurement, plant: Plant) -> _ColumnFit:
    """Regression of the measured force on what the plant gives, without the first second."""
    quiet = with_value(with_value(plant, "cell", "noise_n", 0.0), "cell", "quantum_n", 0.0)
    drive = replace(drive_of(measurement, "inferred"), position_m=None)
    rows = measurement.usable & (measurement.time_s >= min(SETTLING_S, 0.1 * measurement.duration_s))
    x, y = Replay(drive, measurement.even_s or None).run([quiet]).reading_n[0][rows], measurement.force_n[rows]
    return _regression(x, y)


def _regression(x: Floats, y: Floats) -> _ColumnFit:
    """Of y on x, by the ratio of their spreads: noise does not shrink it."""
    spread_x, spread_y = float(np.std(x)), float(np.std(y))
    if not (spread_x > 1.0e-9 and spread_y > 1.0e-12):
        return _ColumnFit(0.0, 0.0)
    alike = float(np.mean((x - x.mean()) * (y - y.mean())) / (spread_x * spread_y))
    return _ColumnFit(float(np.copysign(spread_y / spread_x, alike)), alike)


def _convert_column(measurement: Measurement, column: str, factor: float) -> Measurement | None:
    """The same with one column in its name's unit; None where it is not there or does not drive."""
    if column == "force_n":
        return replace(measurement, force_n=measurement.force_n * factor)
    if column == "command_v" and measurement.command_v is not None:
        return replace(measurement, command_v=measurement.command_v * factor)
    if column == "pressure_kpa" and measurement.pressure_pa is not None and measurement.command_v is None:
        return replace(measurement, pressure_pa=measurement.pressure_pa * factor)
    return None


def _exchange_columns(measurement: Measurement, column: str, other: str) -> Measurement | None:
    """The same with two columns exchanged, number by number; None where one is not there."""
    columns = {
        "command_v": measurement.command_v,
        "force_n": np.where(measurement.usable, measurement.force_n, 0.0),
        "pressure_kpa": None if measurement.pressure_pa is None else measurement.pressure_pa * 1.0e-3,
    }
    first, second = columns[column], columns[other]
    if first is None or second is None:
        return None
    columns[column], columns[other] = second, first
    force_n, pressure_kpa = columns["force_n"], columns["pressure_kpa"]
    assert force_n is not None
    return replace(
        measurement,
        command_v=columns["command_v"],
        force_n=force_n,
        pressure_pa=None if pressure_kpa is None else pressure_kpa * 1.0e3,
    )
