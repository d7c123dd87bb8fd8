"""Which recording is meant: a file, a number of `recordings list`, the last one, or the rig's reference."""

from pathlib import Path
from typing import Final

from gateway.cli.errors import CliError, no_such_recording
from gateway.cli.options import state_directory
from gateway.plain_file import exists
from gateway.processes import exit_codes
from gateway.recording import find_recording, recording_paths

REFERENCE: Final = "reference"
"""What stands for the rig's reference recording where a recording is named."""
LAST: Final = "last"
"""What stands for the newest recording of the state directory."""


def recording_path(name: str, rig: str | None, state: Path | None) -> Path:
    """Return the file of a recording: a path, a number, the `last` one, or the rig's `reference`. CliError (65) where there is
    none."""
    path = Path(name)
    if exists(path):
        return path
    if name == REFERENCE:
        return reference_file(state_directory(state, rig))
    if name == LAST:
        return _last_recording(state_directory(state, rig))
    if name.isdecimal():
        return find_recording(state_directory(state, rig), int(name))
    raise no_such_recording(path)


def numbered_recording(number: int | str, directory: Path) -> Path:
    """Return the file of a recording in a state directory by its number or as the `last` one. CliError or RecordingError where
    there is none."""
    return _last_recording(directory) if number == LAST else find_recording(directory, int(number))


def _last_recording(directory: Path) -> Path:
    paths = recording_paths(directory)
    if not paths:
        raise CliError(f"E403 no recording in {directory}: force-gateway record --for 60s makes one", exit_codes.DATA)
    return paths[-1]


def reference_file(directory: Path) -> Path:
    """Return the rig's reference recording. CliError (65) where none was kept."""
    from gateway.watch.reference_recording import read_reference_recording, reference_path

    known = read_reference_recording(directory)
    if known is None:
        cure = "force-gateway recordings reference RECORDING makes one, of the machine as it should be"
        raise CliError(f"E403 no reference recording in {directory}: {cure}", exit_codes.DATA)
    return reference_path(directory, known)
