"""Headers as people write them: `Time (s)`, `Kraft [N]`, `Druck / bar`, `Force_kgf`, or the unit in a row below.

A column is taken for one of the contract only where its name is one that people use for it, its unit is written down, and
no other column could be meant; a note says so. Everything else is refused with the option that would make it work, in
which units stand as the header says them: a guess that nobody sees is worse than a question.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from gateway.recording.foreign.unit_names import is_unit, unit_of
from gateway.units import LINEAR

MOST_COLUMNS: Final = 4096
"""Of any table: each costs memory for every row."""
WORDS: Final[dict[str, tuple[str, str]]] = {
    "time_s": (
        "time",
        "time|zeit|t|timestamp|time stamp|zeitstempel|uhrzeit|datum|date|datetime|date time|elapsed|elapsed time",
    ),
    "force_n": (
        "force",
        "force|kraft|f|load|contact force|kontaktkraft|anpresskraft|load cell|loadcell|kraftsensor|fz|forza",
    ),
    "command_v": (
        "voltage",
        "command|voltage|spannung|u|output voltage|command voltage|control voltage|dac|analog out|stellspannung|ventilspannung",
    ),
    "pressure_kpa": ("pressure", "pressure|druck|p|air pressure|chamber pressure|cylinder pressure|pression|presion"),
    "position_mm": ("length", "position|pos|weg|hub|displacement|stroke|x"),
    "temperature_c": ("temperature", "temperature|temperatur|temp"),
    "supply_kpa": ("pressure", "supply|supply pressure|versorgungsdruck|netzdruck"),
    "spindle_rpm": ("turning", "spindle|spindle speed|spindeldrehzahl|drehzahl"),
    "feed_mm_s": ("speed", "feed|feed rate|vorschub"),
    "tilt_deg": ("angle", "tilt|tilt angle|neigung"),
}
"""Name in the contract -> its quantity, and what people call it."""
_CALLED: Final = {name: frozenset(words.split("|")) for name, (_, words) in WORDS.items()}
_BRACKETS: Final = re.compile(r"^(.*?)\s*[\[(<{]\s*([^\[\](){}<>]+?)\s*[\])>}]$")
_SIGNS: Final = re.compile(r"\s*[/,;]\s*|\s+in\s+|[_\s]+")
_NOISE: Final = re.compile(r"\b(measured|actual|act|ist|istwert|value|wert|signal)\b")


@dataclass(frozen=True, slots=True)
class Header:
    """text: as it stands; words: what is measured, in small letters; unit: as it is written, "" where none is."""

    text: str
    words: str
    unit: str = ""

    @classmethod
    def of(cls, text: str, unit_below: str = "") -> "Header":
        """Read a header, and the cell of a row of units below it."""
        below = unit_below.strip().strip("[]()").strip()
        name, unit = (text, below) if below and below != "-" else _split_unit(text.strip())
        plain = " ".join(re.sub(r"[_\-./\\:]+", " ", name).casefold().split())
        return cls(text, " ".join(_NOISE.sub(" ", plain).split()) or plain, unit)

    def unit_for(self, name: str) -> str | None:
        """Return the unit of `LINEAR` that is written here for a column of the contract; None where it is none of those."""
        return unit_of(self.unit, WORDS[name][0]) if name in WORDS and self.unit else None


def _split_unit(text: str) -> tuple[str, str]:
    if found := _BRACKETS.match(text):
        return found[1], found[2]
    for sign in _SIGNS.finditer(text):
        if sign.start() and is_unit(text[sign.end() :]):
            return text[: sign.start()], text[sign.end() :]
    return text, ""


@dataclass(frozen=True, slots=True)
class TableHeaders:
    """headers: one per column; stamps: places of columns that hold stamps of time, which need no unit."""

    headers: tuple[Header, ...]
    stamps: frozenset[int] = frozenset()

    @classmethod
    def of(cls, names: Sequence[str], units: Sequence[str] = (), stamps: Iterable[int] = ()) -> "TableHeaders":
        """Read the headers of a table, and the row of units below them where there is one."""
        below = [*units, *[""] * (len(names) - len(units))]
        return cls(tuple(Header.of(name, unit) for name, unit in zip(names, below, strict=False)), frozenset(stamps))

    def understood(self) -> Mapping[int, tuple[str, str | None]]:
        """Return place -> (name in the contract, unit or None for stamps), where only one column can be meant."""
        present = {header.text for header in self.headers}
        found = {}
        for name in WORDS:
            places = [] if name in present else [k for k in range(len(self.headers)) if self._says(k, name)]
            if len(places) == 1:
                found[places[0]] = (name, None if places[0] in self.stamps else self.headers[places[0]].unit_for(name))
        return found

    def _says(self, place: int, name: str) -> bool:
        """Decide whether name and unit of a column are written down as those of one of the contract."""
        header = self.headers[place]
        if header.words not in _CALLED[name]:
            return False
        return (place in self.stamps) if name == "time_s" and not header.unit else header.unit_for(name) is not None

    def suggest(self) -> str:
        """Return the sentence with the `--columns` that is probably meant; "" where nothing is like what is missing."""
        present = {header.text for header in self.headers} | {name for name, _ in self.understood().values()}
        wanted = [name for name in ("time_s", "force_n", "command_v") if name not in present]
        if "pressure_kpa" in present:
            wanted = [name for name in wanted if name != "command_v"]
        parts, remarks, used = [], [], set(self.understood())
        for name in wanted:
            place = self._likely(name, used)
            if place is None and name == "command_v":
                name, place = "pressure_kpa", self._likely("pressure_kpa", used)
            if place is not None:
                used.add(place)
                part, remark = self._entry(name, place)
                parts.append(part)
                remarks += [remark] if remark else []
        said = f" ({'; '.join(remarks)})" if remarks else ""
        return f"Meant is probably --columns {','.join(parts)}{said}" if parts else ""

    def _likely(self, name: str, used: set[int]) -> int | None:
        """Return the column that is most like one of the contract: by what it is called, then by a word, then by its unit."""
        free = [k for k in range(len(self.headers)) if k not in used]
        called = [k for k in free if self.headers[k].words in _CALLED[name]]
        words = [
            k for k in free if set(self.headers[k].words.split()) & {word for word in _CALLED[name] if len(word) > 2}
        ]
        stamped = [k for k in free if k in self.stamps and name == "time_s"]
        both = [k for k in called if k in stamped]
        by_unit = [k for k in free if self.headers[k].unit_for(name)]
        return next(iter([*both, *stamped, *called, *words, *by_unit]), None)

    def _entry(self, name: str, place: int) -> tuple[str, str]:
        """Return `force_n=3:kgf`, and what has to be said about it."""
        header, own = self.headers[place], name.rpartition("_")[2]
        if place in self.stamps:
            return f"{name}={place + 1}", ""
        unit = header.unit_for(name)
        if unit:
            return f"{name}={place + 1}:{unit}", ""
        if header.unit:
            low, high = ("4", "20") if header.unit == "mA" else ("0", "10")
            part = f"{name}={place + 1}:{low}..{high}=0..100{own}"
            return part, f"column {place + 1} is in {header.unit}: put what {low} .. {high} {header.unit} mean in {own}"
        return f"{name}={place + 1}:{own}", f"the unit of column {place + 1} is nowhere: {_choices(name)}"


def _choices(name: str) -> str:
    return ", ".join(LINEAR[WORDS[name][0]])
