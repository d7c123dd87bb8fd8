"""Reading profiles by name or path: a rig, and every file that it names.

A fault in one file does not keep the others from being read: all are told together. Every text that was read goes into
`Findings.texts`, and so into the rig's fingerprint. What one kind needs is imported with the first file of it.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, TypeVar

from gateway.file_signature import JSON, SIGNATURE_BYTES, describe_signature
from gateway.profiles.find import display, locate
from gateway.profiles.kinds.file_kind import CALLED, has_no_other_key, is_foreign, kind_of
from gateway.profiles.strict_yaml.faults import Findings, ProfileError, ProfileFault, one_of
from gateway.profiles.strict_yaml.text import LARGEST_BYTES, Document, parse

if TYPE_CHECKING:
    from gateway.bsfm.model import Calibration
    from gateway.devices import DeviceProfile
    from gateway.profiles.kinds.plants import PlantProfile
    from gateway.registers.map.register_map import RegisterMap

T = TypeVar("T")
Read = Callable[[Document], tuple[T | None, list[ProfileFault]]]


@dataclass(frozen=True, slots=True)
class ProfileReference:
    """A profile's name, and where it was written: `place(sentence)` makes the fault about it."""

    name: str
    place: Callable[[str], ProfileFault]
    beside: Path | None = None
    is_of_any_kind: bool = False  # where it is not found, one of another kind may be proposed


def refer_to(name: str | Path) -> ProfileReference:
    """Return a profile that was named on the command line or by a program."""
    return ProfileReference(str(name), lambda sentence: ProfileFault(str(name) or "''", 0, 0, "", sentence))


def refer_at(
    document: Document, path: tuple[str, ...], folder: Path, default: str | None = None
) -> ProfileReference | None:
    """Return the profile named at a path of a document; None where no name stands (which the types tell) and none is
    the default."""
    name = document.at(*path) if path in document.marks else default
    if not isinstance(name, str) or not name:
        return None
    return ProfileReference(name, lambda sentence: document.fault(path, f"{name} {sentence}"), folder)


def open_profile(kind: str, reference: ProfileReference, findings: Findings) -> tuple[Document, Path] | None:
    """Find, read and parse one file of a kind; None with the faults noted."""
    opened = open_file(kind, reference, findings)
    if opened and has_no_other_key(opened[0].value, kind):
        return opened
    actual_kind = kind_of(opened[0].value, kind) if opened else None
    if opened and actual_kind and actual_kind != kind:
        command = f"`force-gateway check {quote(display(opened[1]))}` takes it as one"
        mismatch = f"is {CALLED[actual_kind]}, {CALLED[kind]} is needed here: {command}"
        findings.faults.append(reference.place(mismatch))
        return None
    if opened and not actual_kind and is_foreign(opened[0].value, kind):
        keys = join_few(map(str, opened[0].value))
        findings.faults.append(reference.place(f"is not {CALLED[kind]}: it holds {keys}, and no key that one has"))
        return None
    return opened


def join_few(words: Iterable[str], most: int = 4) -> str:
    """Return the first few words of a list, for a sentence."""
    known = [word[:20] for word in words]
    return one_of(known[:most]) + (" ..." if len(known) > most else "")


def open_file(kind: str, reference: ProfileReference, findings: Findings) -> tuple[Document, Path] | None:
    """Find, read and parse one file, whatever its kind turns out to be; None with the faults noted."""
    try:
        path = locate(kind, reference.name, reference.beside, of_any_kind=reference.is_of_any_kind)
        size = path.stat().st_size
        data = path.read_bytes() if size <= LARGEST_BYTES else _beginning_of(path)
    except FileNotFoundError as error:
        findings.faults.append(reference.place(str(error)))
        return None
    except OSError as error:
        findings.faults.append(reference.place(f"cannot be read: {error.strerror}"))
        return None
    if other := _other_kind(data):
        findings.faults.append(reference.place(f"is {other}; {CALLED[kind]} is needed here, a YAML file"))
        return None
    if size > LARGEST_BYTES:
        findings.faults.append(reference.place(f"is {size} bytes long: a profile has at most {LARGEST_BYTES}"))
        return None
    findings.texts[display(path)] = data
    try:
        return parse(data, display(path)), path
    except ProfileError as error:
        findings.faults += error.faults
        return None


def _beginning_of(path: Path) -> bytes:
    """Return what tells the kind of a file that is too long for a profile: all of a recording may not fit into memory."""
    with path.open("rb") as file:
        return file.read(LARGEST_BYTES)


def _other_kind(data: bytes) -> str:
    """Return what a file is that is no YAML; JSON is."""
    if not data.strip():
        return "an empty file"
    found = describe_signature(data[:SIGNATURE_BYTES])
    if found:
        return found[0] if found[0] != JSON else ""
    return "a table of values (CSV)" if _is_table(data) else ""


def _is_table(data: bytes) -> bool:
    """Are its first two lines, beside comments, cells of a table? A profile has keys with their colon there."""
    lines = (line for line in data.splitlines() if line.strip() and not line.startswith(b"#"))
    head, row = next(lines, b""), next(lines, b"")
    has_keys = b":" in head or b": " in row
    return not has_keys and any(head.count(cell) == row.count(cell) > 0 for cell in (b",", b";", b"\t"))


def read_named(kind: str, reference: ProfileReference | None, read: Read[T], findings: Findings) -> T | None:
    """Return one profile, or None with the faults noted."""
    opened = open_profile(kind, reference, findings) if reference else None
    if opened is None:
        return None
    value, faults = read(opened[0])
    findings.faults += faults
    if kind == "device":  # its texts are a device's words, in which a `#` may be one
        findings.warnings += opened[0].warn_of_glued_comments()
    return value


def _load(kind: str, name: str | Path, read: Read[T]) -> T:
    findings = Findings()
    value = read_named(kind, refer_to(name), read, findings)
    if value is None or findings.faults:
        raise ProfileError(findings.faults)
    return value


def load_plant(name: str | Path) -> "PlantProfile":
    """Return a plant profile by shipped name or path; ProfileError with every fault. So the three below."""
    from gateway.profiles.kinds.plants import read_plant

    return _load("plant", name, read_plant)


def load_device(name: str | Path) -> "DeviceProfile":
    """Return the device profile of a name or path. ProfileError with every fault of the file."""
    from gateway.profiles.kinds.devices import read_device

    return _load("device", name, read_device)


def load_calibration(name: str | Path) -> "Calibration":
    """Return the calibration of a name or path. ProfileError with every fault of the file."""
    from gateway.profiles.kinds.calibrations import read_calibration

    return _load("calibration", name, read_calibration)


def load_register_map(name: str | Path) -> "RegisterMap":
    """Return the register map of a name or path. ProfileError with every fault of the file."""
    from gateway.profiles.kinds.registers import read_registers

    return _load("registers", name, read_registers)
