"""Strict YAML: text -> plain values, each with its line and column, and every fault at once.

Decisions
- Events, not PyYAML's composer and constructor: they resolve by YAML 1.1, lose positions, and let a repeated key win.
  libyaml's parser is used where the wheel has it (a register map takes 5 ms instead of 100), the Python one otherwise.
- No anchors, aliases or merge keys: a value has one place, a fault one position, and no document grows when it is read.
- No tags but `!!str`: nothing in a profile is an object.
- The first syntax error ends the reading, for what follows it would be guesswork; all other faults are collected.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Final

import yaml

from gateway.profiles.strict_yaml.faults import Path, ProfileError, ProfileFault, path_text
from gateway.profiles.strict_yaml.scalars import plain_scalar
from gateway.profiles.strict_yaml.syntax import TooDeepError, syntax_sentence

_PARSER: Final[Any] = getattr(yaml, "CBaseLoader", yaml.BaseLoader)
LARGEST_BYTES: Final = 1 << 20
_DEEPEST: Final = 32
_NO_KEY: Final = "a key must be a word or a whole number"
_BLOCKS: Final = (">", "|")
_GLUED_COMMENT: Final = re.compile(r"[ \t]+(#[^\s#]\S*)")
_TEXT_TAG: Final = "tag:yaml.org,2002:str"


@dataclass(frozen=True, slots=True)
class Mark:
    """A place in a file, counted from 1: where a value starts and where its key does."""

    line: int
    column: int
    key_line: int
    key_column: int


@dataclass(frozen=True, slots=True)
class Document:
    """One file: its plain value (dict, list, str, int, float, bool, None) and the place of every node."""

    file: str
    value: Any
    marks: dict[Path, Mark] = field(repr=False)
    glued: dict[Path, str] = field(repr=False, default_factory=dict)
    """Behind which unquoted texts a comment begins that has no space behind its `#`, and its first word."""

    def fault(self, path: Path, message: str, *, at_key: bool = False) -> ProfileFault:
        """Return a fault at path; a path that the file does not have is placed at its nearest parent."""
        place = path
        while place not in self.marks and place:
            place, at_key = place[:-1], True
        mark = self.marks.get(place, Mark(1, 1, 1, 1))
        line, column = (mark.key_line, mark.key_column) if at_key else (mark.line, mark.column)
        return ProfileFault(self.file, line, column, path_text(path), message)

    def warn_of_glued_comments(self) -> list[ProfileFault]:
        """Return a warning for each text that may have lost its end: to whoever wrote `V #1` it is one sentence."""
        sentence = (
            "is {text} alone, for `{word}` is a comment: quote the text where it belongs to it, or write `# {bare}`"
        )
        return [
            self.fault(path, sentence.format(text=self.at(*path), word=word, bare=word[1:]))
            for path, word in self.glued.items()
        ]

    def at(self, *path: str | int) -> Any:
        """Return the value at path, None when there is none."""
        value = self.value
        for step in path:
            if isinstance(value, dict):
                value = value.get(step)
            elif isinstance(value, list) and isinstance(step, int) and step < len(value):
                value = value[step]
            else:
                return None
        return value


def parse(data: bytes, file: str) -> Document:
    """Read one file's bytes; ProfileError with all faults."""
    reader = _Reader(file, _decode(data, file))
    value = reader.document()
    if not reader.faults and value is None:
        reader.faults.append(ProfileFault(file, 1, 1, "", "the file is empty: keys such as `name:` are expected"))
    elif not reader.faults and not isinstance(value, dict):
        reader.faults.append(
            ProfileFault(file, 1, 1, "", f"{_kind(value)} at the top: keys such as `name:` are expected")
        )
    if reader.faults:
        raise ProfileError(reader.faults)
    return Document(file, value, reader.marks, reader.glued)


def _kind(value: object) -> str:
    return "a list" if isinstance(value, list) else "a single value"


def _decode(data: bytes, file: str) -> str:
    if len(data) > LARGEST_BYTES:
        raise ProfileError([ProfileFault(file, 0, 0, "", f"{len(data)} bytes: a profile has at most {LARGEST_BYTES}")])
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise ProfileError([ProfileFault(file, 1, 1, "", "the file is UTF-16: save it as UTF-8")])
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = data[: error.start]
        line, column = before.count(b"\n") + 1, len(before.rpartition(b"\n")[2].decode(errors="replace")) + 1
        message = f"byte 0x{data[error.start]:02X} is not UTF-8 (a Latin-1 file?): save it as UTF-8"
        raise ProfileError([ProfileFault(file, line, column, "", message)]) from None


class _Reader:
    """Builds values from the parser's events, and notes where each began."""

    def __init__(self, file: str, text: str) -> None:
        self.file = file
        self.text = text
        self.marks: dict[Path, Mark] = {}
        self.glued: dict[Path, str] = {}
        self.faults: list[ProfileFault] = []

    def document(self) -> Any:
        events = iter(yaml.parse(self.text, Loader=_PARSER))
        try:
            value = self._stream(events)
        except yaml.YAMLError as error:
            line, column, sentence = syntax_sentence(error, self.text)
            self.faults.append(ProfileFault(self.file, line, column, "", sentence))
            return None
        return value

    def _stream(self, events: Iterator[Any]) -> Any:
        next(events)  # stream start
        if isinstance(next(events), yaml.StreamEndEvent):
            return None
        value = self._value(next(events), events, (), None)
        next(events)  # document end
        following = next(events)
        if not isinstance(following, yaml.StreamEndEvent):
            self._fault(following, (), "a second document (`---`): a profile is one document")
        return value

    def _value(self, event: Any, events: Iterator[Any], path: Path, key: Any) -> Any:
        """Return one node and everything below it; `key` is the event of its key, None in lists and at the top."""
        start, key_start = event.start_mark, (key or event).start_mark
        self.marks[path] = Mark(start.line + 1, start.column + 1, key_start.line + 1, key_start.column + 1)
        if isinstance(event, yaml.AliasEvent):
            return self._fault(
                event, path, f"`*{event.anchor}`: aliases are not used here; write the value again, or quote the text"
            )
        if event.anchor is not None:
            sentence = "anchors are not used here; write the value where it is needed, or quote the text"
            self._fault(event, path, f"`&{event.anchor}`: {sentence}")
        if isinstance(event, yaml.ScalarEvent):
            return self._scalar(event, path)
        if event.tag is not None:
            self._fault(event, path, f"tag `{event.tag}`: tags are not used here; quote the text")
        if len(path) >= _DEEPEST:
            raise TooDeepError(problem=f"{_DEEPEST} levels deep", problem_mark=start)
        if isinstance(event, yaml.MappingStartEvent):
            return self._mapping(events, path)
        return self._sequence(events, path)

    def _scalar(self, event: Any, path: Path) -> Any:
        if event.tag not in (None, _TEXT_TAG):
            return self._fault(event, path, f"tag `{event.tag}`: tags are not used here; quote the text")
        if event.style in _BLOCKS and not event.value:
            sentence = "begins text on the lines below it, and none is there: quote it where it is meant itself"
            return self._fault(event, path, f"`{event.style}` {sentence}")
        if "\0" in event.value:  # ends a name for the operating system, whose calls refuse it in their own words
            return self._fault(event, path, "`\\0` may stand in no text: leave it out")
        if not event.implicit[0]:  # quoted, a block, or `!!str`; both parsers say it here, not in `style`
            return event.value
        try:
            value = plain_scalar(event.value)
            if isinstance(value, str) and (comment := _GLUED_COMMENT.match(self.text, event.end_mark.index)):
                self.glued[path] = comment[1]
            return value
        except ValueError as error:
            return self._fault(event, path, str(error))

    def _sequence(self, events: Iterator[Any], path: Path) -> list[Any]:
        values: list[Any] = []
        while not isinstance(event := next(events), yaml.SequenceEndEvent):
            values.append(self._value(event, events, (*path, len(values)), None))
        return values

    def _mapping(self, events: Iterator[Any], path: Path) -> dict[Any, Any]:
        values: dict[Any, Any] = {}
        first_line: dict[str, int] = {}
        while not isinstance(event := next(events), yaml.MappingEndEvent):
            key = self._key(event, events, path)
            line = event.start_mark.line + 1
            if key is not None and str(key) in first_line:
                message = f"the key stands twice; the first is in line {first_line[str(key)]}"
                self._fault(event, (*path, key), message)
                key = None
            step = key if key is not None else str(getattr(event, "value", "?"))
            value = self._value(next(events), events, (*path, step), event)
            if key is not None:
                values[key] = value
                first_line[str(key)] = line
        return values

    def _key(self, event: Any, events: Iterator[Any], path: Path) -> str | int | None:
        """Return the key's value; None, with a fault noted, for one that no profile has."""
        if isinstance(event, yaml.CollectionStartEvent):
            _skip(events)  # of any depth: its keys may be such ones, too
            self._fault(event, path, _NO_KEY)
            return None
        known, mark = len(self.faults), self.marks[path]
        value = self._value(event, events, path, None)
        self.marks[path] = mark  # a key is no node of its own
        if isinstance(value, (str, int)) and not isinstance(value, bool) and len(self.faults) == known:
            return value
        if len(self.faults) == known:
            self._fault(event, path, _NO_KEY)
        return None

    def _fault(self, event: Any, path: Path, message: str) -> None:
        mark = event.start_mark
        self.faults.append(ProfileFault(self.file, mark.line + 1, mark.column + 1, path_text(path), message))


def _skip(events: Iterator[Any]) -> None:
    """Pass over the rest of a list or a mapping that has begun."""
    depth = 1
    while depth:
        event = next(events)
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
