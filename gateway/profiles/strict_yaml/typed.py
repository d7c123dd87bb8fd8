"""Plain YAML values -> frozen dataclasses, by pydantic, with its findings told at their place in the file.

Values go through JSON: there pydantic's strict mode takes a mapping for a dataclass, a list for a tuple and a name for an
enum, but never "5" for 5 or 5.0 for a count, which is what a profile needs. Bounds, defaults and unknown keys come from the
dataclasses themselves (`Annotated[float, Gt(0)]`, `__pydantic_config__ = {"extra": "forbid"}`): the rooms own their settings.
"""

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, Field, fields, is_dataclass, replace
from functools import cache
from types import UnionType
from typing import Annotated, Any, Final, TypeVar, Union, cast, get_args, get_origin, get_type_hints

from pydantic import TypeAdapter, ValidationError

from gateway.profiles.strict_yaml.fault_sentences import quote_value, tell_group, type_sentence, unit_of, unknown_key
from gateway.profiles.strict_yaml.faults import FaultKind, Path, ProfileFault, one_of, path_text
from gateway.profiles.strict_yaml.text import Document

T = TypeVar("T")
_MOST_FINDINGS: Final = 50
_MOST_NODES: Final = 3000
_PROPOSED: Final[Mapping[str, Callable[[Any], Any]]] = {
    "string_type": lambda value: str(value).lower() if isinstance(value, bool) else f"{value}",
    "tuple_type": lambda value: [value],
}
"""Kind of a finding -> what its sentence proposes for a word or a number."""
_WORDS: Final = ("literal_error", "string_type", "int_type", "float_type", "bool_type")  # what is no word, no number


@cache
def adapter(kind: type) -> TypeAdapter[Any]:
    """Return pydantic's view of one dataclass; built once, because it costs milliseconds."""
    return TypeAdapter(kind)


def build(kind: type[T], document: Document, path: Path = ()) -> tuple[T | None, list[ProfileFault]]:
    """Return the dataclass at `path` of the document, or None and every fault."""
    try:
        value: T = adapter(cast("Any", kind)).validate_json(json.dumps(document.at(*path)), strict=True)
        return value, []
    except ValidationError as error:
        findings = _keep_first_findings(error)
    faults = [_fault(kind, document, path, *placed) for placed in _place_findings(document, path, findings)]
    return None, sorted(_without_echoes(faults))


def build_known(kind: type[T], document: Document, path: Path) -> T | None:
    """Return the dataclass at `path`, for cross-checks: keys that mean nothing there are left out, any other fault
    gives None."""
    value, faults = build(kind, document, path)
    strangers = {fault.path for fault in faults if fault.kind is FaultKind.STRANGER and not fault.meant}
    group = document.at(*path)
    if value is not None or not isinstance(group, dict) or len(strangers) < len(faults):
        return value
    known = {key: group[key] for key in group if path_text((*path, key)) not in strangers}
    return build(kind, Document(document.file, known, document.marks))[0]


def _keep_first_findings(error: ValidationError) -> list[Any]:
    """Return one finding per place, the first: a union reports each of its members, and a list too few entries where it
    has left out those with a finding of their own. No more than a person reads: a sentence takes half a millisecond, and a
    hostile document may have thousands."""
    first = error.errors(include_url=False)[:_MOST_FINDINGS]
    inside = {finding["loc"][:-1] for finding in first}
    first = [finding for finding in first if finding["type"] != "too_short" or finding["loc"] not in inside]
    return list({_steps(finding["loc"]): finding for finding in reversed(first)}.values())[::-1]


def _without_echoes(faults: list[ProfileFault]) -> list[ProfileFault]:
    """Return the findings without a missing key that is misspelt beside it: the first tells what was meant."""
    suggestions = {f"{fault.path.rpartition('.')[0]}.{fault.meant}".lstrip(".") for fault in faults if fault.meant}
    return [fault for fault in faults if not (fault.path in suggestions and fault.kind is FaultKind.MISSING)]


def _steps(location: tuple[int | str, ...]) -> tuple[int | str, ...]:
    return tuple(step for step in location if not (isinstance(step, str) and any(sign in step for sign in "[(-")))


def _place_findings(document: Document, path: Path, findings: list[Any]) -> list[tuple[Path, Any]]:
    """Return one finding for each place of the document. Where a word or a group of keys may stand and a group does, what
    keeps it from being the word is no finding beside what is wrong with the group."""
    placed = [(_place(document, path, finding), finding) for finding in findings]
    inside = {place[:end] for place, _ in placed for end in range(len(place))}
    inside |= {place for place, finding in placed if finding["type"] not in _WORDS}
    kept: dict[Path, Any] = {}
    for place, finding in placed:
        if not (finding["type"] in _WORDS and place in inside and isinstance(document.at(*place), dict)):
            kept.setdefault(place, finding)
    return list(kept.items())


def _fault(kind: type, document: Document, path: Path, place: Path, finding: Mapping[str, Any]) -> ProfileFault:
    key = place[-1] if place else ""
    if finding["type"] == "missing":
        missing = f"is missing{_what_it_is(place[len(path) :])}"
        return replace(document.fault(place, missing, at_key=True), kind=FaultKind.MISSING)
    if finding["type"] in ("extra_forbidden", "unexpected_keyword_argument"):
        holder = kind_at(kind, place[len(path) : -1], document.at(*place[:-1])) or kind
        known = names(holder)
        here = next((step for step in reversed(place[:-1]) if isinstance(step, str)), "")  # also of its other types
        elsewhere = {name: f"under {group}" for name, group in groups_by_key(kind, here).items()}
        elsewhere |= getattr(holder, "KEPT_ELSEWHERE", {})
        sentence, suggestion = unknown_key(str(key), document.at(*place[:-1]), known, elsewhere)
        return replace(document.fault(place, sentence, at_key=True), kind=FaultKind.STRANGER, meant=suggestion)
    error = (finding.get("ctx") or {}).get("error")
    if written := getattr(error, "written", ""):
        place = _place_of(written, document, place)
    fault = document.fault(place, _sentence(kind, document, path, place, finding))
    there = (key for key in getattr(error, "misfits", ()) if (*place, key) in document.marks)
    if misfit := next(there, ""):  # its sentence names the key: the line alone is told
        mark = document.marks[(*place, misfit)]
        fault = replace(fault, line=mark.key_line, column=mark.key_column)
    return fault


def _place_of(text: str, document: Document, group: Path) -> Path:
    """Return where a text stands in a group whose rule has refused it; the group where it stands there more than once."""
    found = [place for place in document.marks if place[: len(group)] == group and document.at(*place) == text]
    return found[0] if len(found) == 1 else group


def _sentence(kind: type, document: Document, path: Path, place: Path, finding: Mapping[str, Any]) -> str:
    """Return what is wrong with a value that is there, and what may stand in its place."""
    value, inside, key = document.at(*place), place[len(path) :], place[-1] if place else ""
    if finding["type"] in _PROPOSED and isinstance(value, (str, int, float)):
        proposed = _PROPOSED[finding["type"]](value)
        if again := _finding_with(kind, document, path, place, proposed):
            return _refusal(kind, inside, value, proposed, again)
    types = _types(kind, inside)
    if finding["type"] == "union_tag_not_found":
        finding = {**finding, "ctx": {"types": types}}
    field = _field(kind_at(kind, inside[:-1], document.at(*place[:-1])), key)
    sentence = type_sentence(finding, value, key, optional=field is not None and _has_default(field))
    if finding["type"] == "dict_type" and types:
        return f"{sentence} with a type: {one_of(types)}"
    group = kind_at(kind, inside)
    if finding["type"] not in ("dataclass_type", "literal_error") or value is None or not is_dataclass(group):
        return sentence
    without = field is not None and field.default is None
    return tell_group(sentence, value, names(group), without=without, empty=all(map(_has_default, fields(group))))


def _refusal(kind: type, inside: Path, value: Any, proposed: Any, again: Mapping[str, Any]) -> str:
    """Return why what a sentence would propose is refused, too: `bind: true` was told to go in quotes, and refused there."""
    if not isinstance(proposed, list):
        return type_sentence(again, proposed, inside[-1])
    types = f" with a type: {one_of(_types(kind, inside))}" if again["type"] == "dict_type" else ""
    return f"{quote_value(value)} is not a list, and {type_sentence(again, value, inside[-1])}{types}"


def _finding_with(kind: type, document: Document, path: Path, place: Path, value: Any) -> Mapping[str, Any] | None:
    """Return the first finding at a place if this value stood there, None where it would be taken. Not asked of a document that
    is longer than people write: each answer reads all of it."""
    if len(document.marks) > _MOST_NODES:
        return None
    holder, kept = document.at(*place[:-1]), document.at(*place)
    holder[place[-1]] = value
    try:
        adapter(cast("Any", kind)).validate_json(json.dumps(document.at(*path)), strict=True)
    except ValidationError as error:
        findings = _keep_first_findings(error)
        return next((one for one in findings if _place(document, path, one)[: len(place)] == place), None)
    finally:
        holder[place[-1]] = kept
    return None


def _types(kind: type, path: Path) -> list[str]:
    """Return the words that the `type` of a group of several kinds may be; `kind` itself may be several, at no path."""
    steps = [step for step in path if isinstance(step, str)]
    holder = kind_at(kind, tuple(steps[:-1]))
    kinds = [inner for name, inner in groups(holder) if name == steps[-1]] if holder and steps else _kinds(kind)
    return [word for inner in kinds for word in get_args(get_type_hints(inner).get("type"))]


def _field(kind: type | None, key: object) -> Field[Any] | None:
    known = fields(kind) if kind is not None and is_dataclass(kind) else ()
    return next((field for field in known if field.name == key), None)


def _has_default(field: Field[Any]) -> bool:
    return not (field.default is MISSING and field.default_factory is MISSING)


def _place(document: Document, path: Path, finding: Mapping[str, Any]) -> Path:
    """pydantic's location as a path of the document: names of union members are left out, keys keep the file's type."""
    place, location = path, finding["loc"]
    for index, step in enumerate(location):
        here = document.at(*place)
        if isinstance(here, dict):
            match = next((key for key in here if str(key) == str(step)), None)
            if match is None and (index + 1 < len(location) or finding["type"] != "missing"):
                continue
            place = (*place, step if match is None else match)
        elif isinstance(here, list) and isinstance(step, int):
            place = (*place, step)
    return place


def _what_it_is(place: Path) -> str:
    unit = unit_of(place[-1]) if place else ""
    return f" (a value in{unit})" if unit else ""


def names(kind: type) -> list[str]:
    """Return the keys that a group may have."""
    return [field.name for field in fields(kind)] if is_dataclass(kind) else []


def kind_at(kind: type, path: Path, group: Any = None) -> type | None:
    """Return the dataclass that describes the group at `path` below `kind`, None when it is no dataclass. group: what
    stands there; where there are several kinds of group, its `type` decides."""
    current: type | None = kind
    for step in path:
        if isinstance(step, int):
            continue
        if current is None or not is_dataclass(current):
            return None
        candidates = [inner for name, inner in groups(current) if name == step]
        current = next((one for one in candidates if _is_of_type(one, group)), candidates[0] if candidates else None)
    return current


def _is_of_type(kind: type, group: Any) -> bool:
    """Decide whether the word that a group has as `type` is this dataclass's own."""
    return isinstance(group, dict) and group.get("type") in get_args(get_type_hints(kind).get("type"))


@cache
def groups(kind: type) -> tuple[tuple[str, type], ...]:
    """Return (key, dataclass) for each field of a dataclass that is one itself, also as `X | None` or `tuple[X, ...]`."""
    if not is_dataclass(kind):  # a union of several
        return ()
    hints = get_type_hints(kind)
    return tuple(
        (field.name, candidate)
        for field in fields(kind)
        for candidate in _members(hints[field.name])
        if is_dataclass(candidate) and isinstance(candidate, type)
    )


def _kinds(hint: Any) -> list[type]:
    """Return the dataclasses of a union of several; of one alone none, for nothing chooses it."""
    if is_dataclass(hint):
        return []
    return [one for one in _members(hint) if is_dataclass(one) and isinstance(one, type)]


def _members(hint: Any) -> Iterator[Any]:
    if get_origin(hint) is Annotated:
        yield from _members(get_args(hint)[0])
    elif get_origin(hint) in (Union, UnionType, tuple):
        for member in get_args(hint):
            yield from _members(member)
    else:
        yield hint


def groups_by_key(kind: type, but: str) -> dict[str, str]:
    """Return where each key of a nested group belongs: {"force_max_n": "limits", "unit": "load_cell or fieldbus"}. but: a
    group that is none of these."""
    found: dict[str, list[str]] = {}
    for group, inner in groups(kind):
        for name in names(inner) if group != but else ():
            found.setdefault(name, []).append(group)
    return {name: " or ".join(dict.fromkeys(where)) for name, where in found.items()}
