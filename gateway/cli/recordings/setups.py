"""The set-ups of a replay: the rig and calibration that a recording was made with, and another one to compare with."""

from gateway.bsfm.model import Calibration
from gateway.cli.errors import CliError
from gateway.cli.options import StateChoice
from gateway.plain_file import expand_home, is_file
from gateway.plants.recorded_number import header_in_use
from gateway.processes import exit_codes
from gateway.profiles import Rig, list_shipped, load_calibration, read_rig
from gateway.recording import Recording
from gateway.recording.calibrations_used import later_calibrations, tell_changes
from gateway.service.replayed_control import ReplaySetup


def own_setup(recording: Recording, state: StateChoice) -> tuple[ReplaySetup, list[str]]:
    """Return the set-up that a recording was made with, as far as it is here, and what differs. A rig that is no shipped one is
    found by the file that --rig names, or that the gateway which runs on this state directory was started with. CliError (65)
    where its rig is not known."""
    from gateway.service.fitting.recorded_rig import rig_of

    named = recording.header.get("rig")
    rig = rig_of(recording)
    if rig is None and named and is_file(expand_home(meant := state.rig)):
        given = read_rig(meant)
        rig = given if given.name == named else None
    if rig is None:
        what = f"its rig {named} is not known here: give that rig's file by --rig" if named else "it names no rig"
        raise CliError(f"E403 {recording.path} cannot be replayed: {what}", exit_codes.DATA)
    notes = []
    if recording.header.get("rig_fingerprint") not in (None, rig.fingerprint):
        notes.append(f"the files of rig {rig.name} have changed since it was recorded, or were not read from here")
    if number := header_in_use(recording.header).get("number"):
        notes.append(f"plant {number} was in use; what was compensated of it is not replayed")
    number = recording.header.get("calibration")
    calibration = _stored(rig, number, state)
    if calibration is None:
        calibration = rig.calibration
        notes.append(f"calibration {number}, with which it was made, is not stored here: the rig's own is taken")
    name = f"rig {rig.name}, calibration {calibration.number} {calibration.name}"
    return ReplaySetup(name, rig, calibration, _later(recording, rig, state, notes)), notes


def _stored(rig: Rig, number: object, state: StateChoice) -> Calibration | None:
    from gateway.cli.calibration.store_access import find_calibration, open_store

    named = str(number)  # of a CSV: its text
    if not named.isdecimal() or int(named) in (0, rig.calibration.number):
        return rig.calibration
    try:
        return find_calibration(open_store(state.directory, rig.name), named)
    except CliError:
        return None


def _later(recording: Recording, rig: Rig, state: StateChoice, notes: list[str]) -> dict[int, Calibration]:
    """Return the calibrations that were taken into use amid the recording, as far as they are here."""
    later: dict[int, Calibration] = {}
    for number in dict.fromkeys(change.number for change in later_calibrations(recording)):
        if found := _stored(rig, number, state):
            later[number] = found
        else:
            notes.append(f"calibration {number} is not stored here: the one before it goes on in its place")
    if changes := tell_changes(recording):
        notes.append(f"the calibration changed amid it, and so it does here: {changes}")
    return later


def other_setup(which: str, own: ReplaySetup, state: StateChoice) -> ReplaySetup:
    """Return the set-up that --against means: another rig, or the same rig with another calibration (its number, or a file).
    A shipped name that both have is the rig's."""
    from gateway.cli.calibration.store_access import find_calibration, open_store

    if which.isdecimal():
        calibration = find_calibration(open_store(state.directory, own.rig.name), which)
    elif _is_rig(which):
        rig = read_rig(which)
        return ReplaySetup(
            f"rig {rig.name}, calibration {rig.calibration.number} {rig.calibration.name}", rig, rig.calibration
        )
    else:
        calibration = load_calibration(which)
    name = f"rig {own.rig.name}, calibration {calibration.number} {calibration.name}"
    return ReplaySetup(name, own.rig, calibration)


def _is_rig(which: str) -> bool:
    from gateway.profiles import check_file

    return which in list_shipped("rig") or (is_file(which) and check_file(which).kind == "rig")
