"""Which rigs there are, and which is meant: a shipped name, a rig file, or one that has run here.

Without a name it is the one whose gateway runs on this machine, where that is one; where several do, and none of them is
demo, it has to be named; else demo. Of a state directory that was given alone it is the one whose gateway runs on it, else
the one whose recordings lie there: by the files of demo its own calibration, limits and retention would be another rig's.
"""

import os
from pathlib import Path
from shlex import quote

import click

from gateway import defaults
from gateway.plain_file import expand_home, is_directory, is_file


def running_rigs() -> list[str]:
    """Return the names of the state directories whose gateway runs on this machine."""
    from gateway.cli.master.local_gateways import is_there
    from gateway.service.supervisor.run_options import default_state_root

    return [path.parent.name for path in sorted(default_state_root().glob("*/control.sock")) if is_there(path.parent)]


def rigs_with_state() -> list[str]:
    """Return the names of rigs that have run here, with the usual state directory. A start that was refused leaves its event
    there and a lock, no folder: `run dmo` is no rig that has run."""
    from gateway.service.supervisor.run_options import default_state_root

    root = default_state_root()
    return sorted(path.name for path in root.iterdir() if _has_run(path)) if is_directory(root) else []


def _has_run(state: Path) -> bool:
    try:
        return any(is_directory(entry) for entry in state.iterdir())
    except NotADirectoryError:
        return False
    except OSError:  # another user's
        return True


def _has_state(name: str) -> bool:
    from gateway.service.supervisor.run_options import default_state_root

    return Path(name).name == name and is_directory(default_state_root() / name)


def known_rigs() -> list[str]:
    """Return every name that --rig takes besides files: the shipped ones first."""
    from gateway.profiles import list_shipped

    return list(dict.fromkeys([*list_shipped("rig"), *rigs_with_state()]))


def check_rig(name: str) -> None:
    """Raise UsageError for a rig that is neither known nor a file; it lists those that are."""
    path = expand_home(name)
    if name in known_rigs() or _has_state(name) or is_file(path) or is_file(path.with_name(f"{path.name}.yaml")):
        return
    if os.path.lexists(path):
        raise click.UsageError(f"rig {name} {_what_is_there(name)}")
    from difflib import get_close_matches

    near = get_close_matches(name, known_rigs(), n=1)
    meant = f"; did you mean {near[0]}?" if near else "."
    ran = [rig for rig in rigs_with_state() if rig not in _shipped()]
    here = f" Run here: {', '.join(ran)}." if ran else ""
    what = "is no file, and no rig of this name is known" if path.suffix in (".yaml", ".yml") else "is not known"
    raise click.UsageError(
        f"rig {name} {what}{meant} Shipped: {', '.join(_shipped())}.{here} Or a file, such as my-cell.yaml."
    )


def _what_is_there(name: str) -> str:
    """Return what keeps a name that is there from being a rig's file: a pipe, a link to nothing."""
    from gateway.profiles.find import locate

    try:
        return f"is {locate('rig', name)}"  # it has become a file meanwhile
    except FileNotFoundError as error:
        return str(error)


def _shipped() -> list[str]:
    from gateway.profiles import list_shipped

    return list_shipped("rig")


def choose_rig(given: str | None, state: Path | None) -> str:
    """Return the rig that is meant. state: the directory that was given instead: then the rig need not be known. UsageError
    where several run here and none of them is demo: of demo nobody has spoken."""
    if given is not None:
        if state is None:
            check_rig(given)
        return given
    if state is not None:
        return _rig_on(state) or defaults.RIG
    running = running_rigs()
    if len(running) > 1 and defaults.RIG not in running:
        raise click.UsageError(
            f"{' and '.join(running)} run here: --rig says which one is meant, such as --rig {running[0]}."
        )
    return running[0] if len(running) == 1 else defaults.RIG


def file_of(name: str, state: Path) -> str:
    """Return the file of a rig of one's own that runs on this state directory: by its name it is known to no other folder.
    The name as it is where it is shipped or a file, or where nobody says."""
    from gateway.cli.master.local_gateways import rig_running_on

    path = expand_home(name)
    if name in _shipped() or is_file(path) or is_file(path.with_name(f"{path.name}.yaml")):
        return name
    found = rig_running_on(state)
    return found if found and is_file(found) else name


def _rig_on(state: Path) -> str | None:
    from gateway.cli.master.local_gateways import rig_running_on
    from gateway.service.fitting.ladder_source import rig_of_state

    return rig_running_on(state) or rig_of_state(state)


def directory_of(state: Path | None, rig: str | None) -> Path:
    """Return the state directory that `run` would use."""
    from gateway.service.supervisor.run_options import RunOptions

    return RunOptions(rig=rig or choose_rig(None, None)).state_directory if state is None else state


def tell_rig_fault(rig_name: str) -> str:
    """Return what is to be mended in the rig's file before it can be read; empty where nothing is, and of a name
    without a file."""
    from gateway.profiles import ProfileError, read_rig
    from gateway.profiles.find import locate

    try:
        locate("rig", rig_name)
        read_rig(rig_name)
    except FileNotFoundError:
        return ""
    except ProfileError as error:
        return f"{error.faults[0]} (`force-gateway check {quote(rig_name)}` tells of every fault)"
    return ""
