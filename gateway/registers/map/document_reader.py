"""Typed fields out of plain YAML content, collecting every fault with its place instead of stopping at the first."""

import re
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from math import isfinite
from typing import Any, Final, NamedTuple

from gateway.registers.values import WordOrder

Place = tuple[str | int, ...]


class Flaw(NamedTuple):
    """One fault of a document. is_of_key: a key that is missing or unknown, not the value that stands there."""

    place: Place
    sentence: str
    is_of_key: bool = False


_NAME: Final = re.compile(r"[a-z][a-z0-9_]*")


class DocumentReader:
    """Collects faults; what its methods return is of use only when there are none."""

    def __init__(self) -> None:
        self.faults: list[Flaw] = []

    def fault(self, place: Place, sentence: str, *, is_of_key: bool = False) -> None:
        """Note a fault. is_of_key: it is the key and not its value that is wrong."""
        self.faults.append(Flaw(place, sentence, is_of_key))

    def keys(self, place: Place, content: Mapping[str, Any], known: tuple[str, ...]) -> None:
        """Check that all keys are known."""
        for key in content:
            if key not in known:
                self.fault((*place, key), f"is not a known key{suggest(str(key), known)}", is_of_key=True)

    def group(self, place: Place, content: Any) -> Mapping[str, Any]:
        """Return a mapping; a fault and an empty one for anything else."""
        if isinstance(content, Mapping):
            return content
        self.fault(place, "is missing" if content is None else "is not a group of keys", is_of_key=content is None)
        return {}

    def by_name(self, place: Place, content: Any) -> Mapping[str, Any]:
        """Return a mapping as `group`, of the keys that are words; a fault for each that is a number."""
        entries = self.group(place, content)
        for key in (key for key in entries if not isinstance(key, str)):
            self.fault((*place, key), f"{key} is a number, a name is needed", is_of_key=True)
        return {key: value for key, value in entries.items() if isinstance(key, str)}

    def is_name(self, place: Place, name: str) -> None:
        """Check that this is a name of registers, blocks or values."""
        if not _NAME.fullmatch(name):
            self.fault(place, f'"{name}" is not a name: small letters, digits and _, beginning with a letter')

    def text(self, place: Place, content: Mapping[str, Any], key: str, default: str | None = None) -> str:
        """Return a text; a fault and an empty one for anything else."""
        value = content.get(key, default)
        if not isinstance(value, str):
            self.fault(
                (*place, key) if key in content else place,
                f"{key} is not text" if key in content else f"{key} is missing",
                is_of_key=key not in content,
            )
            return ""
        return value

    def number(self, place: Place, content: Mapping[str, Any], key: str) -> float:
        """Return a finite number; a fault and 0 for anything else."""
        value = content[key]
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not isfinite(value):
            self.fault((*place, key), f"{value} is not a number")
            return 0.0
        return value

    def whole(self, place: Place, content: Mapping[str, Any], key: str, low: int, high: int) -> int:
        """Return a whole number within low .. high; a fault and low for anything else."""
        value = content.get(key)
        if value is None:
            self.fault(place, f"{key} is missing", is_of_key=True)
        elif not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
            self.fault((*place, key), f"{value} is not a whole number {low} .. {high}")
        else:
            return value
        return low

    def order(self, place: Place, content: Mapping[str, Any]) -> WordOrder:
        """Return the word order; a fault and abcd for an unknown one."""
        given = content.get("word_order", "abcd")
        if given not in tuple(WordOrder):
            self.fault((*place, "word_order"), f"{given} is not abcd or cdab")
            return WordOrder.ABCD
        return WordOrder(given)

    def read_numbered(
        self, place: Place, given: Any, most: int, known: Mapping[str, Mapping[int, str]]
    ) -> Mapping[int, str]:
        """Return {number: name}, as given or as the named one of `known` has it; numbers may have become text (JSON)."""
        if isinstance(given, str):
            if given not in known:
                self.fault(place, f"{given} is not one of {', '.join(known)}{suggest(given, known)}")
            return known.get(given, {})
        names: dict[int, str] = {}
        for key, name in self.group(place, given).items():
            is_number = str(key).isdecimal() and int(key) <= most
            if not is_number or not isinstance(name, str) or not _NAME.fullmatch(name) or name in names.values():
                self.fault((*place, key), f"{key}: {name} is not a number 0 .. {most} with a name of its own")
            else:
                names[int(key)] = name
        return names


def suggest(word: str, known: Iterable[str]) -> str:
    """Return "; did you mean ...?" with the nearest known word, empty where none is near."""
    near = get_close_matches(word, list(known), 1, 0.6)
    return f"; did you mean {near[0]}?" if near else ""
