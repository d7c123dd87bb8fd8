"""A plant as the text of a plant file, which `load_plant` reads back to the same plant, to the last bit.

One leaf a line, in the order of the twin's fields, as the shipped plants have it. What has its null value and no origin is
left out: off equals absent. Numbers keep a point (`1.0e-05`, not `1e-05`), so that readers of YAML 1.1 take them for numbers
too; texts are double-quoted, for a source may hold any sign.
"""

from collections.abc import Iterator, Mapping
from dataclasses import fields
from math import isfinite
from typing import Final

from gateway.profiles.kinds.plants import Origin, PlantProfile
from gateway.twin import Plant
from gateway.twin.plant import values

UNSTATED: Final = "not stated"
"""Source of a number that nobody gave one for."""

_SCHEMA_LINE: Final = "# force-gateway schema plant > plant.json gives editors the schema\n"


def plant_text(profile: PlantProfile, comment: str = "") -> str:
    """Return the whole file. comment: lines to stand at its top. ValueError for a plant of lanes or with a number that is not
    finite, which no file can hold."""
    head = "".join(f"# {line}\n" for line in comment.splitlines())
    about = f"name: {_quote(profile.name)}\ndescription: {_quote(profile.description)}\n"
    return _SCHEMA_LINE + head + about + "".join(_sections(profile))


def with_origins(profile: PlantProfile, plant: Plant, sources: Mapping[str, str]) -> PlantProfile:
    """Return the profile with another plant's numbers. sources: by path, for the numbers whose origin is new.

    What has changed without a source says so; a range that the new value has left is widened to hold it.
    """
    origins = dict(profile.origins)
    null = {f"{section}.{name}": value for section, name, value in values(Plant())}
    for section, name, value in values(plant):
        path = f"{section}.{name}"
        known = profile.origins.get(path)
        if path in sources or (known is None and value != null[path]) or (known and known.value != value):
            origins[path] = _origin(float(value), sources.get(path, UNSTATED), known)
    return PlantProfile(name=profile.name, description=profile.description, plant=plant, origins=origins)


def _origin(value: float, source: str, known: Origin | None) -> Origin:
    bounds = known.range if known else None
    return Origin(value, source, (min(bounds[0], value), max(bounds[1], value)) if bounds else None)


def _sections(profile: PlantProfile) -> Iterator[str]:
    null = Plant()
    for section in fields(Plant):
        part, absent = getattr(profile.plant, section.name), getattr(null, section.name)
        lines = []
        for field in fields(part):
            value, origin = getattr(part, field.name), profile.origins.get(f"{section.name}.{field.name}")
            if origin or value != getattr(absent, field.name):
                lines.append(f"  {field.name}: {_leaf(value, origin)}\n")
        if lines:
            yield f"\n{section.name}:\n" + "".join(lines)


def _leaf(value: object, origin: Origin | None) -> str:
    source = _quote(origin.source if origin else UNSTATED)
    bounds = origin.range if origin else None
    end = f", range: [{_number(bounds[0])}, {_number(bounds[1])}]" if bounds else ""
    return f"{{value: {_number(value)}, source: {source}{end}}}"


def _number(value: object) -> str:
    if isinstance(value, int) and not isinstance(value, bool):
        return str(value)
    number = float(value)  # type: ignore[arg-type]  # a lane's array says so itself
    if not isfinite(number):
        raise ValueError(f"{number} is not a number that a plant file can hold")
    mantissa, exponent, power = repr(number).partition("e")
    return f"{mantissa if '.' in mantissa else mantissa + '.0'}{exponent}{power}"


def _quote(text: str) -> str:
    return '"' + "".join(map(_escape, text)) + '"'


def _escape(sign: str) -> str:
    if sign in '"\\':
        return "\\" + sign
    if sign.isprintable():
        return sign
    code = ord(sign)
    if 0xD800 <= code < 0xE000:  # half of a surrogate pair is no sign, in YAML as in UTF-8
        return "\ufffd"
    return f"\\x{code:02X}" if code < 0x100 else f"\\u{code:04X}" if code < 0x10000 else f"\\U{code:08X}"
