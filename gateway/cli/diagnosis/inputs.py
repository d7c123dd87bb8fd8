"""What is diagnosed: recordings by path or number, and the plant that they are compared with."""

import contextlib
import filecmp
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click
import numpy as np

from gateway import defaults
from gateway.cli.errors import CliError
from gateway.cli.options import state_directory
from gateway.cli.recordings.named_recording import recording_path
from gateway.diagnosis.measurement import Measurement
from gateway.diagnosis.model_fit.base_fit import without_effects
from gateway.plants.recorded_number import header_in_use
from gateway.processes import exit_codes
from gateway.profiles.kinds.plants import PlantProfile, load_shipped_plant
from gateway.recording import Recording, read_table
from gateway.recording.calibrations_used import tell_changes
from gateway.recording.measurement import measurement_of
from gateway.recording.tables.column_names import SENT
from gateway.recording.tables.mapping_file import column_mapping
from gateway.service.fitting.recorded_rig import is_rehearsal, plant_of, recorded_noise_n, rig_of, rig_texts
from gateway.twin.plant import values

if TYPE_CHECKING:
    from gateway.profiles import Rig

_WIRE_S: Final = 0.035  # a frame at 9600 baud, the amplifier's own period, and the sampling
_LEAST_MOVE_V: Final = 0.2  # the trim of a force that is held moves less
START_PLANT: Final = defaults.PLANT
_ANY_STATE: Final = defaults.RIG  # whose state directory is meant where neither --state nor --rig says one


@dataclass(frozen=True, slots=True, kw_only=True)
class Sources:
    """Everything that the diagnosis takes."""

    paths: tuple[Path, ...]  # of the recordings, as given
    measurements: tuple[Measurement, ...]
    plant: PlantProfile
    rig: str  # its name; empty for none
    known_rig: "Rig | None"  # where it is known here
    notes: tuple[str, ...]  # what was decided
    late_s: float = 0.0  # how late the wires may have made the readings
    quantum_n: float = 0.0  # known step of the readings
    calibration_noise_n: float | None = None  # at rest, by their calibration; None: not known
    is_own: bool = False  # the plant is that of the rig that the recordings were made on
    straightened: dict[str, Any] | None = None  # what a plant in use has taken back of the first readings
    factors: dict[str, dict[str, float]] = field(default_factory=dict)  # by which each column was multiplied
    is_rehearsal: bool = False  # made while the devices of a real rig were simulated

    @property
    def name(self) -> str:
        """The recordings in a few words."""
        first, count = self.paths[0].name, len(self.paths)
        return first if count == 1 else f"{first} and {count - 1} more"


def read_sources(
    names: Sequence[str],
    *,
    rig: str | None,
    columns: str | None,
    state: Path | None,
    calibration: str | None = None,
) -> Sources:
    """Read everything that the diagnosis takes. RecordingError and CliError (65) for data, ProfileError for a rig.

    calibration: number, name or file of the one that the recordings were made under, None for what they say themselves.
    """
    paths = tuple(recording_path(name, rig, state) for name in names)
    refuse_twice(paths)
    known = _read_rig(rig) if rig else None
    mapping = column_mapping(columns)
    recordings = [read_table(path, mapping) for path in paths]
    measurements = tuple(
        _without_polled_pressure(measurement_of(each)) if _of_gateway(each) else measurement_of(each)
        for each in recordings
    )
    plant_of_first = None if known else plant_of(recordings[0])
    rig_name, plant, notes = _of_rig(known) if known else _find_rig_of_recordings(recordings, plant_of_first)
    here = known or rig_of(recordings[0])
    noise_n, unknown = _calibration_noise(recordings, calibration, known, state)
    return Sources(
        paths=paths,
        measurements=measurements,
        plant=plant,
        rig=rig_name,
        known_rig=here,
        notes=(*notes, *unknown, *_changes_of_calibration(recordings), *_unknown_settings(recordings)),
        calibration_noise_n=noise_n,
        late_s=_WIRE_S if all(map(_of_gateway, recordings)) else 0.0,
        quantum_n=_quantum_n(here) if all(map(_of_gateway, recordings)) else 0.0,
        straightened=header_in_use(recordings[0].header).get("cell"),
        factors={each.path.name: each.factors for each in recordings},
        is_own=plant is (known.plant_profile if known else plant_of_first),
        is_rehearsal=any(map(is_rehearsal, recordings)),
    )


def refuse_still(old: Sources) -> None:
    """Refuse older recordings in none of which the command moves (CliError 65): they show nothing of the machine, and what was
    there before would be told as a change."""
    commands = [each.command_v for each in old.measurements]
    if not any(drive is None or np.nanmax(drive) - np.nanmin(drive) > _LEAST_MOVE_V for drive in commands):
        names = ", ".join(each.name for each in old.measurements)
        why = "the command does not move, so nobody knows from it what belongs to the machine; --against one with work in it"
        raise CliError(f"E403 {names}: {why}", exit_codes.DATA)


def refuse_twice(paths: Sequence[Path]) -> None:
    """Refuse a recording that is named twice, or a copy of it, as the rig's reference is one: UsageError. Its noise would be
    what two have in common, and count as evidence."""
    for at, path in enumerate(paths):
        for first in paths[:at]:
            is_same = path.resolve() == first.resolve()
            if is_same or _is_copy(path, first):
                what = "is named twice" if is_same else f"is a copy of {first}"
                raise click.UsageError(f"{path} {what}: a recording is no evidence for itself; leave one out")


def _is_copy(path: Path, other: Path) -> bool:
    with contextlib.suppress(OSError):  # whoever reads it tells why
        return filecmp.cmp(path, other, shallow=False)
    return False


def _calibration_noise(
    recordings: Sequence[Recording], given: str | None, rig: "Rig | None", state: Path | None
) -> tuple[float | None, tuple[str, ...]]:
    """Noise of the readings at rest, N, None where no calibration tells it, and what to say of that.

    By the calibration that is given, else by what each recording carries, else by what is in use on the rig that is given.
    """
    if given:
        from gateway.cli.calibration.store_access import find_calibration, open_store

        name = rig.name if rig else str(recordings[0].header.get("rig") or _ANY_STATE)
        found = find_calibration(open_store(state_directory(state, name), name), given)
        if found.noise_n > 0.0:
            return found.noise_n, ()
        return None, (f"calibration {found.name} carries no noise of the cell: one made anew does, see calibrate",)
    carried = [recorded_noise_n(each) for each in recordings]
    known = [each for each in carried if each is not None]
    if len(known) == len(recordings):
        return max(known), ()
    if rig is None:
        return None, ()
    from gateway.calibrations.store import calibration_in_use

    noise_n = calibration_in_use(rig, state_directory(state, rig.name)).noise_n
    return (noise_n if noise_n > 0.0 else None), ()


def _changes_of_calibration(recordings: Sequence[Recording]) -> list[str]:
    told = [(each.path.name, tell_changes(each)) for each in recordings]
    return [f"{name}: {changes}" for name, changes in told if changes]


def _unknown_settings(recordings: Sequence[Recording]) -> list[str]:
    """Return a sentence for each of a gateway's own recordings that does not hold what went out, and when."""
    return [
        f"{each.path.name} has no {' and '.join(SENT)}: it is replayed with what was wanted and not with what the device was "
        "sent, so a cause of some tenths of a newton may be that; a new recording holds both"
        for each in recordings
        if _of_gateway(each) and not set(SENT) <= set(each.columns)
    ]


def _read_rig(name: str) -> "Rig":
    from gateway.profiles import read_rig

    return read_rig(name)


def _quantum_n(rig: "Rig | None") -> float:
    """One count of the rig's amplifier, N; 0 where it is not known."""
    if rig is None:
        return 0.0
    from gateway.devices import cell_host

    line = rig.load_cell
    return cell_host(line.device, line.sign, line.unit).resolution_n


def _of_rig(rig: "Rig") -> tuple[str, PlantProfile, tuple[str, ...]]:
    if rig.plant_profile:
        return rig.name, rig.plant_profile, ()
    plant = rig.fallback_plant or load_shipped_plant(START_PLANT)
    return rig.name, plant, (f"rig {rig.name} names no plant: {plant.name} is the start",)


def _find_rig_of_recordings(
    recordings: Sequence[Recording], plant: PlantProfile | None
) -> tuple[str, PlantProfile, tuple[str, ...]]:
    """The rig that the first recording carries or names, and its plant where there is one; else the paper's."""
    names = [str(recording.header.get("rig") or "") for recording in recordings]
    notes = [f"the recordings are of several rigs: {', '.join(sorted(set(names)))}"] if len(set(names)) > 1 else []
    if plant is None:
        plant = _undescribed_machine(load_shipped_plant(START_PLANT))
        missing = f"rig {names[0]} is not known here" if names[0] else "the recording names no rig"
        notes.append(f"{missing}: the plant {START_PLANT} without its effects is the start; --rig names another")
    return names[0], plant, tuple(notes)


def _undescribed_machine(profile: PlantProfile) -> PlantProfile:
    """The start for a machine that nobody described: nobody said that it has this one's delay or seals."""
    plant = without_effects(profile.plant)
    now = {f"{section}.{name}": value for section, name, value in values(plant)}
    origins = {path: origin for path, origin in profile.origins.items() if origin.value == now[path]}
    return replace(profile, plant=plant, origins=origins)


def _of_gateway(recording: Recording) -> bool:
    """Is it one of the gateway's own?"""
    return bool(rig_texts(recording))


def _without_polled_pressure(measurement: Measurement) -> Measurement:
    """The gateway polls the regulator's pressure a few times a second and holds it: it is no witness of transients."""
    return replace(measurement, pressure_pa=None) if measurement.command_v is not None else measurement
