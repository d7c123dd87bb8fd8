"""Going on with a run that was stopped: what its plan was, and which groups it has not climbed."""

from pathlib import Path
from typing import Any

from gateway.bsfm.ladder_check import checked_ladder
from gateway.bsfm.ladder_fault import LadderError
from gateway.cli import exit_codes
from gateway.cli.errors import CliError
from gateway.recording import Recording, list_recordings, read_recording


def resumed(state: Path) -> tuple[dict[str, Any], list[int]]:
    """The plan's fields for the rest, and the numbers of the recordings with whole groups so far."""
    ladders = [entry for entry in list_recordings(state) if entry.header.get("ladder")]
    if not ladders:
        raise CliError(
            f"E422 no calibration run is recorded in {state / 'recordings'}: nothing to go on with", exit_codes.DATA
        )
    last = read_recording(ladders[-1].path)
    plan = {name: value for name, value in last.header["ladder"].items() if name != "stairs"}
    climbed = int(plan["first_group"]) + _whole_groups(last)
    earlier = [int(number) for number in last.header.get("continues", ())]
    if _whole_groups(last):
        earlier.append(ladders[-1].number)
    plan["first_group"] = min(climbed, int(plan["groups"]) - (not plan["minor_points"]))
    return plan, earlier


def _whole_groups(recording: Recording) -> int:
    try:
        checked = checked_ladder(recording.columns, recording.header)
    except LadderError:
        return 0
    return 0 if checked.only_walk else len(checked.ladder.groups)
