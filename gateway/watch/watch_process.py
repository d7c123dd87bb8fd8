"""The residual watch as a process: `python -m gateway.watch.watch_process LINK '{"rig": ..., "ring": descriptor, ...}'`.

It must never be felt. It runs in the kernel's idle class, of processor and disk alike, uses one thread, a fortieth of one core
at most in the long run (`processor_budget`), gives back what memory a look leaves, is the first to go when memory runs out,
and shares with control nothing but memory that it can only read, and a socket that it speaks to for a millisecond. Everything
heavy is imported when there is a window to judge: a gateway that runs for less, as in most tests, never pays for it. It ends
with the guardian: the end of its link ends it, whatever it is doing.
"""

import contextlib
import json
import socket
import sys
import time
from collections.abc import Iterator, Sequence
from functools import partial
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from gateway import progress
from gateway.extras import MissingExtraError
from gateway.processes import exit_codes
from gateway.processes.beside_control import exit_with_guardian, yield_to_others
from gateway.processes.state_directory import CONTROL_SOCKET
from gateway.side_by_side import one_after_another
from gateway.watch.memory import give_large_arrays_back_at_once, resident_mb, return_memory
from gateway.watch.processor_budget import ProcessorBudget

if TYPE_CHECKING:
    from gateway.diagnosis import Diagnosis, Measurement
    from gateway.profiles import Rig
    from gateway.recording.ring import RingReader
    from gateway.twin.plant import Plant
    from gateway.watch.force_watch import ForceWatch, PlantSince
    from gateway.watch.residual_watch import Watch, WindowComparison

_ALL_ROWS: Final = 1 << 30
_ANSWER_S: Final = 5.0
_LONGEST_ANSWER: Final = 1 << 16
_ROOM_BYTES: Final = 2_000_000  # of a stage of a replay: forty series of a window


def report_to_control(state: Path, message: dict[str, Any]) -> dict[str, Any]:
    """Say it to control and return its answer, empty from a control that is being restarted: it hears it the next time."""
    with contextlib.suppress(OSError), socket.socket(socket.AF_UNIX) as control:
        control.settimeout(_ANSWER_S)
        control.connect(str(state / CONTROL_SOCKET))
        control.sendall(json.dumps({"do": "residual"} | message).encode() + b"\n")
        with contextlib.suppress(ValueError):
            answer = json.loads(control.recv(_LONGEST_ANSWER))
            return answer if isinstance(answer, dict) else {}
    return {}


def make_watch(ring: "RingReader", options: dict[str, Any]) -> tuple["Watch", "ForceWatch"]:
    """Return the watch over the rig, and that over the force. Everything heavy is imported here."""
    from gateway.plants.in_use import with_selected_plant
    from gateway.profiles.kept_rig import rig_as_started
    from gateway.watch.force_watch import ForceWatch
    from gateway.watch.residual_watch import Watch, WatchSettings

    state = Path(options["state"])
    rig, _ = with_selected_plant(rig_as_started(options), state)
    setup = WatchSettings(options["window_s"], options["every_s"])
    watch = Watch(ring, make_comparison(rig, state), setup, time.monotonic)
    return watch, ForceWatch(state, rig.control.defaults.in_band_tolerance_n)


def make_comparison(rig: "Rig", state: Path) -> "WindowComparison":
    """Return what windows are compared with: the machine of the reference recording where one is kept whose readings were
    straightened as they are now, else the plant, the one in use where there is one."""
    from gateway.calibrations.store import calibration_in_use
    from gateway.recording import RecordingError
    from gateway.watch.described_machine import described_machine, is_straightened_alike
    from gateway.watch.force_watch import TOLERANCE_SHARE
    from gateway.watch.machine_comparison import MachineComparison
    from gateway.watch.plant_comparison import PlantComparison
    from gateway.watch.reference import WatchReference
    from gateway.watch.reference_recording import read_reference_recording

    assert rig.reference_plant is not None  # or nobody had started us
    least_n = TOLERANCE_SHARE * rig.control.defaults.in_band_tolerance_n
    known = read_reference_recording(state)
    try:
        if known and is_straightened_alike(state, known, rig.compensation.cell):
            machine = described_machine(state, known, rig.reference_plant)
            return MachineComparison(machine, known.name, rig.reference_plant, least_n)
    except (OSError, RecordingError, ValueError) as error:
        sys.stderr.write(f"the reference {known and known.name} is left out: {error}\n")
    noise_n = calibration_in_use(rig, state).noise_n or None
    diagnose = partial(diagnose_window, calibration_noise_n=noise_n)
    return PlantComparison(WatchReference(rig.reference_plant), diagnose, least_n)


def diagnose_window(
    measurements: "Sequence[Measurement]", plant: "Plant", calibration_noise_n: float | None = None
) -> "Diagnosis":
    """Return the diagnosis of a window. Imports the search when it is called. calibration_noise_n: see its Options."""
    from gateway.diagnosis import Options, diagnose

    return diagnose(measurements, plant, Options(is_own=True, calibration_noise_n=calibration_noise_n))


@contextlib.contextmanager
def work_gently() -> Iterator[None]:
    """Have what is done in this block done by one thread that keeps little, and give memory back between its stages and after
    it."""
    from gateway.twin.replay.cache import room_for_series

    give_large_arrays_back_at_once()
    with progress.listen(_return_memory_between_stages), one_after_another(), room_for_series(_ROOM_BYTES):
        yield
    return_memory()


def watch_forever(options: dict[str, Any]) -> None:
    """Look, tell, sleep; for ever. Begin anew where another plant has come into use. The look at the force is cheap, so it is
    told before the other begins, which may take long."""
    time.sleep(options["window_s"])
    from gateway.recording.ring import RingReader
    from gateway.watch.reference_recording import FirstGoodRecording, read_reference_recording

    ring, state, budget = RingReader(options["ring"]), Path(options["state"]), ProcessorBudget()
    with work_gently():
        watch, force = make_watch(ring, options)
    last_plant: PlantSince | None = None
    reference, search = read_reference_recording(state), FirstGoodRecording(state)
    reported_s, spent_s = time.monotonic(), 0.0
    while True:
        plant = _plant_of(report_to_control(state, {}))
        if plant is not None and plant != last_plant:
            if last_plant is not None:  # rows from before the change were read and commanded otherwise
                time.sleep(max(0.0, options["window_s"] - (time.monotonic() - plant.since_s)))
                with work_gently():
                    watch, force = make_watch(ring, options)
            last_plant = plant
            force.follow(plant)
        with contextlib.suppress(OSError):  # a full disk: the next look tries again
            search.keep(time.time())
        if (found := read_reference_recording(state)) != reference:
            reference = found
            with work_gently():
                watch, _ = make_watch(ring, options)
        sentence_before = force.sentence
        force.look(ring.newest(_ALL_ROWS), ring.columns)
        if force.sentence != sentence_before:
            report_to_control(state, _report(watch, force, {}))
        with work_gently():
            watch.check_newest_window()
        now_s, total_s = time.monotonic(), time.process_time()
        rest_s = budget.pause_s(options["every_s"], now_s - reported_s, total_s - spent_s)
        reported_s, spent_s = now_s, total_s
        counters = {"cpu_s": total_s, "pause_s": rest_s, "memory_mb": resident_mb()}
        report_to_control(state, _report(watch, force, counters))
        time.sleep(rest_s)


def _report(watch: "Watch", force: "ForceWatch", more: dict[str, float]) -> dict[str, Any]:
    """Return what both watches say, as control takes it. more: counters of the process."""
    counters = {name: value for name, value in (watch.counters | more).items() if isfinite(value)}  # JSON has no NaN
    published = watch.published
    return {
        "cause": int(published.cause),
        "sentence": published.sentence,
        "worse": force.sentence,
        "why_skipped": watch.why_skipped,
        "counters": counters,
    }


def _plant_of(answer: dict[str, Any]) -> "PlantSince | None":
    """Return the plant in use as control says; None where it has not answered."""
    from gateway.watch.force_watch import PlantSince

    return PlantSince(answer["plant"], answer["plant_since_s"]) if "plant" in answer else None


def _return_memory_between_stages(now: progress.Progress) -> None:
    """What one stage of a search has freed is not for the next one only."""
    if not now.done:
        return_memory()


def main(arguments: list[str]) -> int:
    """Watch until the guardian ends. arguments: descriptor of the link, options as JSON."""
    yield_to_others()
    exit_with_guardian(socket.socket(fileno=int(arguments[0])))
    try:
        watch_forever(json.loads(arguments[1]))
    except _told_in_words() as why:
        sys.stderr.write(f"{why}\n")
    return exit_codes.DEVICE


def _told_in_words() -> tuple[type[Exception], ...]:
    """Return the errors that a sentence says all of. Asked once something is raised: the rig's modules are heavy."""
    from gateway.profiles.kept_rig import ChangedRigError

    return MissingExtraError, ChangedRigError  # numba is there, or nobody had started us, and does not load


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
