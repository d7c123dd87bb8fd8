"""Going on with a run that was stopped: what its plan was, and which groups it has not climbed.

A group counts once all of its stairs were left by the run itself; a cut one is climbed again, from rest and after the check's
cycle, as every recording begins. A recording that may not be fitted counts for nothing. Of other recordings, which may have
gigabytes, only the headers are read.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from gateway.bsfm.ladder.check import check_ladder
from gateway.bsfm.ladder.labels import Labels
from gateway.bsfm.ladder.ladder_error import LadderError
from gateway.calibrations.kept_ladders import find_last_ladder
from gateway.cli.errors import CliError
from gateway.plain_file import exists
from gateway.processes import exit_codes
from gateway.processes.state_directory import RECORDINGS
from gateway.recording import Recording, RecordingError, read_header, read_recording, recording_paths

_NO_PLAN: Final = ("stairs", "top_v")  # what the header says beside the plan's own fields
_PLAN: Final = ("groups", "minor_points", "step_v", "v_max_v")  # without which nobody knows what is left


@dataclass(frozen=True, slots=True)
class RestOfLadder:
    """What a stopped ladder has left to climb.

    plan: fields of the whole run; groups: climbed so far; earlier: numbers of the recordings that have them; finished: the
    last recording came to its own end; fingerprint: of the rig's files then.
    """

    plan: dict[str, Any]
    groups: int
    earlier: list[int]
    name: str
    fingerprint: str
    last: Path
    finished: bool

    def plan_with(self, changes: dict[str, Any]) -> dict[str, Any]:
        """Return what is left to climb with these changes."""
        plan = self.plan | changes
        last_start = int(plan["groups"]) - (not plan["minor_points"])
        return plan | {"first_group": min(self.groups, last_start)}

    def is_whole(self, plan: dict[str, Any]) -> bool:
        """Return whether nothing is left of this plan but the fit."""
        wants_walk = plan["minor_points"] and not self.plan["minor_points"]
        return self.finished and self.groups >= int(plan["groups"]) and not wants_walk


def find_rest_of_ladder(state: Path) -> RestOfLadder:
    """Return what is left of the last recorded ladder. CliError where none is recorded."""
    path, header = _last_ladder(state)
    plan, last = _plan_of(header["ladder"], path), read_recording(path)
    earlier = {number: _whole_groups(_beside(path, number)) for number in header.get("continues", ())}
    climbed = earlier | {int(path.stem): _whole_groups(last)}
    used = [number for number, groups in climbed.items() if groups]
    finished = _is_finished(last) and all(earlier.values())
    groups, fingerprint = sum(climbed.values()), header.get("rig_fingerprint", "")
    return RestOfLadder(plan, groups, used, header.get("name", ""), fingerprint, path, finished)


def _plan_of(facts: dict[str, Any], path: Path) -> dict[str, Any]:
    """Return the plan of a stopped ladder. CliError for one of another program, that does not say all of it."""
    plan = {name: value for name, value in facts.items() if name not in _NO_PLAN}
    plan["tare"] = False  # the zero is that of the first part: a slide that has pressed does not rest at it
    plan["v_max_v"] = facts.get("top_v", plan.get("v_max_v"))  # the same stairs again, whatever model is in use by now
    if missing := [name for name in _PLAN if plan.get(name) is None]:
        sentence = f"{path} does not say the {', '.join(missing)} of its ladder, as a gateway's own does: begin anew"
        raise CliError(f"E422 {sentence}, without --resume", exit_codes.DATA)
    return plan


def _last_ladder(state: Path) -> tuple[Path, dict[str, Any]]:
    if last := find_last_ladder(recording_paths(state)):
        return last
    sentence = f"no calibration run is recorded in {state / RECORDINGS}: nothing to go on with"
    raise CliError(f"E422 {sentence}", exit_codes.DATA)


def rig_of(recording: Path, named: str) -> str:
    """Return the rig file that a recording names, if that can (still) be read, else the one that was named."""
    file = str(read_header(recording).get("rig_file", ""))
    return file if file and exists(file) else named


def _beside(path: Path, number: int) -> Recording | None:
    """None for one that is gone or damaged."""
    try:
        return read_recording(path.with_name(f"{number:04d}{path.suffix}"))
    except (OSError, RecordingError):
        return None


def _whole_groups(recording: Recording | None) -> int:
    try:
        checked = check_ladder(recording.columns, recording.header) if recording else None
    except LadderError:
        return 0
    return 0 if checked is None or checked.only_walk else len(checked.ladder.groups)


def _is_finished(recording: Recording) -> bool:
    """Its last stair was left: the run has come to its own end."""
    labels = Labels.of(recording.columns)
    return labels is not None and labels.is_finished
