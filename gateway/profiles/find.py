"""Where profiles are: the shipped ones, and those that people keep beside their rig file."""

from pathlib import Path
from typing import Final

import gateway
from gateway.plain_file import DIRECTORY, expand_home, other_kind
from gateway.profiles.kinds.file_kind import is_foreign, keys_at_the_top, kind_of
from gateway.profiles.strict_yaml.faults import closest, one_of

FOLDERS: Final = {
    "rig": "rigs",
    "device": "devices",
    "plant": "plants",
    "calibration": "calibrations",
    "registers": "registers",
    "plan": "plans",
}
"""Kind of profile -> its folder."""

_SUFFIXES: Final = (".yaml", ".yml")
_LOOK_BYTES: Final = 65536


def shipped_profiles_folder() -> Path:
    """Return the folder of the shipped profiles: gateway/_profiles in an installed wheel, else the checkout's profiles/."""
    package = Path(gateway.__file__).parent
    installed = package / "_profiles"
    return installed if installed.is_dir() else package.parent / "profiles"


def list_shipped(kind: str) -> list[str]:
    """Return names of the shipped profiles of a kind (rig, device, plant, calibration, registers, plan)."""
    return sorted(path.stem for path in (shipped_profiles_folder() / FOLDERS[kind]).glob("*.yaml"))


def locate(kind: str, name: str, beside: Path | None = None) -> Path:
    """Return the file of a profile: a shipped name, else a path (relative to the folder `beside`, or to the working
    directory), else the name of a file there or in its folder of that kind: `device: my-dac` is my-dac.yaml or
    devices/my-dac.yaml.

    FileNotFoundError with a sentence that follows the name: what is there, and what was probably meant.
    """
    if not name:
        raise FileNotFoundError("an empty name, as of a variable that is not set")
    known = list_shipped(kind)
    if name in known:
        return shipped_profiles_folder() / FOLDERS[kind] / f"{name}.yaml"
    folder = beside or Path()
    path = folder / expand_home(name)
    for candidate in (path, folder / f"{name}.yaml", folder / FOLDERS[kind] / f"{name}.yaml"):
        if _is_file(candidate):
            return candidate
    if other := _other_kind(path):
        cure = ": name the file in it" if other == DIRECTORY else f", and no {kind} file"
        raise FileNotFoundError(f"is {other}{cure}")
    if target := _lost_target(path):
        raise FileNotFoundError(f"is a link to {target}, where no file is")
    if "/" in name or name.endswith(_SUFFIXES):
        raise FileNotFoundError(f"is no file (looked for {display(path)}){_near(kind, path)}")
    near = closest(name, known)
    suggestion = f"; did you mean {near}?" if near else ""
    raise FileNotFoundError(f"is neither a shipped {kind} ({one_of(known) or 'there is none'}) nor a file{suggestion}")


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # a name that is too long, or holds what no file name may
        return False


def _other_kind(path: Path) -> str:
    try:
        return other_kind(path)
    except (OSError, ValueError):
        return ""


def _lost_target(path: Path) -> str:
    """Return where a link leads that stands there, empty where none does."""
    try:
        return str(path.readlink())
    except (OSError, ValueError):
        return ""


def _near(kind: str, path: Path) -> str:
    try:
        here = [entry.name for entry in path.parent.iterdir() if entry.suffix in _SUFFIXES and _is_file(entry)]
    except (OSError, ValueError):
        return ""
    near = closest(path.name, [name for name in here if _may_be(kind, path.with_name(name))])
    return f"; did you mean {near}?" if near else ""


def _may_be(kind: str, path: Path) -> bool:
    """Decide whether a file is of a kind, as far as its beginning says; one with a fault may be."""
    try:
        with path.open("rb") as file:
            keys = keys_at_the_top(file.read(_LOOK_BYTES))
    except OSError:
        return False
    return kind_of(keys, kind) in (kind, None) and not is_foreign(keys, kind)


def display(path: Path) -> str:
    """Return a path as messages show it: short below the working directory, whole elsewhere."""
    try:
        return str(path.absolute().relative_to(Path.cwd()))
    except (OSError, ValueError):
        return str(path)
