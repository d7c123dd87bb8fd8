"""Every value of a rig and of the files that it names, each with the line where it stands, or with the default's own place."""

from collections.abc import Iterator
from dataclasses import MISSING, fields, is_dataclass
from typing import Any, Final, cast

from gateway.profiles.find import display
from gateway.profiles.load import open_profile, refer_to
from gateway.profiles.rigs.assembly import check_report
from gateway.profiles.rigs.rig_file import RigFile
from gateway.profiles.schema import field_comments
from gateway.profiles.strict_yaml.fault_sentences import unit_of
from gateway.profiles.strict_yaml.faults import Findings, ProfileError, path_text
from gateway.profiles.strict_yaml.text import Document, parse
from gateway.profiles.strict_yaml.typed import build

SECRET: Final = ("token", "password", "key")
"""Last words of a path whose value is not shown."""
_ORIGINATED: Final = {"value", "source"}
HIDDEN: Final = "••••••"
Row = dict[str, Any]
Path = tuple[str | int, ...]


def rig_document(name: str, *, simulated: bool) -> dict[str, Any]:
    """Return rig, fingerprint, notes, warnings, and its files with their values. ProfileError for one that is faulty."""
    report = check_report(name, simulated=simulated)
    findings = Findings()
    opened = open_profile("rig", refer_to(name), findings)
    if report.rig is None or opened is None:
        raise ProfileError(report.faults or findings.faults)
    document, path = opened
    file, faults = build(RigFile, document)
    if file is None:
        raise ProfileError(faults)
    own = display(path)
    files = [{"file": own, "is_rig": True, "values": list(_typed_values(file, document, ()))}]
    for other, text in report.rig.texts.items():
        if other != own:
            files.append({"file": other, "is_rig": False, "values": list(_plain_values(parse(text.encode(), other)))})
    return {
        "rig": report.rig.name,
        "description": report.rig.description,
        "simulated": report.rig.simulated,
        "fingerprint": report.rig.fingerprint,
        "notes": list(report.rig.notes),
        "warnings": [str(fault) for fault in report.warnings],
        "files": files,
    }


def _typed_values(group: object, document: Document, path: Path) -> Iterator[Row]:
    """Yield each value of a dataclass and of those below it, as set in the file or as the default is."""
    kind: Any = type(group)
    comments = field_comments(kind)
    for field in fields(cast("Any", group)):
        value, here = getattr(group, field.name), (*path, field.name)
        if is_dataclass(value):
            yield from _typed_values(value, document, here)
        elif isinstance(value, tuple) and value and is_dataclass(value[0]):
            for place, member in enumerate(value):
                yield from _typed_values(member, document, (*here, place))
        else:
            yield _row(here, value, document) | {"about": comments.get(field.name, ""), "default": _default(field)}


def _default(field: Any) -> str:
    """Return what the value is where the file leaves it out; empty for one that every file must have."""
    if field.default is not MISSING:
        return _words(field.default)
    return "" if field.default_factory is MISSING else _words(field.default_factory())


def _plain_values(document: Document) -> Iterator[Row]:
    """Yield each value that stands in a file; a list of plain values is one, and so is a number with its source."""
    for path in document.marks:
        value = document.at(*path)
        if isinstance(value, dict) and value.keys() >= _ORIGINATED:
            limits = f", range {_words(value['range'])}" if "range" in value else ""
            yield _row(path, value["value"], document) | {"about": f"{value['source']}{limits}", "default": ""}
            continue
        if isinstance(document.at(*path[:-1]), dict) and document.at(*path[:-1]).keys() >= _ORIGINATED:
            continue
        is_group = isinstance(value, dict) or (
            isinstance(value, list) and any(isinstance(v, (dict, list)) for v in value)
        )
        is_in_list = bool(path) and isinstance(path[-1], int) and not isinstance(value, (dict, list))
        if path and not is_group and not is_in_list:
            yield _row(path, value, document) | {"about": "", "default": ""}


def _row(path: Path, value: Any, document: Document) -> Row:
    mark = document.marks.get(path)
    is_secret = str(path[-1]).rpartition("_")[2] in SECRET
    words = HIDDEN if is_secret and value else _words(value)
    return {
        "path": path_text(path),
        "value": words,
        "unit": unit_of(str(path[-1])).strip(),
        "line": mark.line if mark else None,
    }


def _words(value: Any) -> str:
    """Return a value as the file would have it."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(_words, value))}]"
    return repr(value).removesuffix(".0") if isinstance(value, float) else str(value)
