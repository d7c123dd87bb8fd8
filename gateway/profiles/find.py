"""Where profiles are: the shipped ones, and those that people keep beside their rig file."""

from collections.abc import Collection
from pathlib import Path
from typing import Final

import gateway
from gateway.plain_file import DIRECTORY, expand_home, is_directory, other_kind
from gateway.profiles.kinds.file_kind import CALLED, is_foreign, keys_at_the_top, kind_of
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
    return installed if is_directory(installed) else package.parent / "profiles"


def shipped_file(kind: str, name: str) -> Path:
    """Return where the shipped profile of this name is, whether or not it is there."""
    return shipped_profiles_folder() / FOLDERS[kind] / f"{name}.yaml"


def list_shipped(kind: str) -> list[str]:
    """Return names of the shipped profiles of a kind (rig, device, plant, calibration, registers, plan)."""
    return sorted(path.stem for path in (shipped_profiles_folder() / FOLDERS[kind]).glob("*.yaml"))


def locate(kind: str, name: str, beside: Path | None = None, *, of_any_kind: bool = False) -> Path:
    """Return the file of a profile: a shipped name, else a path (relative to the folder `beside`, or to the working
    directory), else the name of a file there or in its folder of that kind: `device: my-dac` is my-dac.yaml or
    devices/my-dac.yaml. of_any_kind: a profile of another kind may have been meant, too.

    FileNotFoundError with a sentence that follows the name: what is there, and what was probably meant.
    """
    if not name:
        raise FileNotFoundError("an empty name, as of a variable that is not set")
    known = list_shipped(kind)
    if name in known:
        return shipped_file(kind, name)
    folder = beside or Path()
    path = folder / expand_home(name)
    for candidate in (path, folder / f"{name}.yaml", folder / FOLDERS[kind] / f"{name}.yaml"):
        if _is_file(candidate):
            return candidate
    if refusal := _refusal_of(path):
        raise FileNotFoundError(f"cannot be looked for: {refusal}")
    if other := _other_kind(path):
        cure = ": name the file in it" if other == DIRECTORY else f", and no {_called(kind)} file"
        raise FileNotFoundError(f"is {other}{cure}")
    if target := _lost_target(path):
        raise FileNotFoundError(f"is a link to {target}, where no file is")
    kinds = tuple(FOLDERS) if of_any_kind else (kind,)
    if "/" in name or name.endswith(_SUFFIXES):
        raise FileNotFoundError(
            f"is no file (looked for {display(path)}){_meant(path.name, _files_in(path.parent, kinds))}"
        )
    names = [shipped for each in kinds for shipped in list_shipped(each)]
    for place in (folder, *(folder / FOLDERS[each] for each in kinds)):
        names += [Path(file).stem for file in _files_in(place, kinds)]
    shipped = f"{_called(kind)} ({one_of(known) or 'there is none'})"
    raise FileNotFoundError(f"is neither a shipped {shipped} nor a file{_meant(name, names)}")


def _called(kind: str) -> str:
    return CALLED[kind].partition(" ")[2]


def _is_file(path: Path) -> bool:
    try:
        return not other_kind(path)
    except (OSError, ValueError):  # a name that is too long, or holds what no file name may
        return False


def _refusal_of(path: Path) -> str:
    """Return why this user may not look whether a file is there; empty where he may."""
    try:
        path.stat()
    except PermissionError as error:
        return str(error.strerror)
    except (OSError, ValueError):
        return ""
    return ""


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


def _meant(name: str, known: Collection[str]) -> str:
    near = closest(name, known)
    return f"; did you mean {near}?" if near else ""


def _files_in(folder: Path, kinds: Collection[str]) -> list[str]:
    """Return the names of the profiles of these kinds in a folder; of none where it cannot be read."""
    try:
        here = [entry for entry in folder.iterdir() if entry.suffix in _SUFFIXES and _is_file(entry)]
    except (OSError, ValueError):
        return []
    return [entry.name for entry in here if any(_may_be(kind, entry) for kind in kinds)]


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
