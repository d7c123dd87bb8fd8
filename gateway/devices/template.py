"""A text template, compiled to an encoder and a decoder: "SET {counts:d}" is both `SET 512` and how to read it.

There are no branches, loops or arithmetic here, and there never will be: a device that needs them gets a Python codec.
Text is printable ASCII, and what frames have besides: SOH, STX, ETX, EOT, ENQ, ACK, NAK, ESC, tab, and CR or LF ahead of
the end. A template that could be read in two ways (two open fields without a mark between them) is refused when it is compiled.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from math import isnan
from string import Formatter
from typing import Final

from gateway.devices.fields import Choice, Decimals, Field, Plain, TemplateError, Text, Value, ValueRefused, field_from

_NAMES: Final = {
    "\x01": "<SOH>", "\x02": "<STX>", "\x03": "<ETX>", "\x04": "<EOT>", "\x05": "<ENQ>", "\x06": "<ACK>", "\x15": "<NAK>",
    "\x1b": "<ESC>", "\t": "<TAB>",
}  # fmt: skip
CONTROL_CHARACTERS: Final = "".join(_NAMES)
_WITH_NAMES: Final = str.maketrans(_NAMES)
TEXT_CHARACTERS: Final = " -~\r\n\x02\x03\x1b\t"
"""What sentences mostly consist of: a line with other characters is noise where nobody has written it down."""
_TEXT: Final = re.compile(rf"[{TEXT_CHARACTERS}{CONTROL_CHARACTERS}]+(?<![\r\n])")
_SPELT: Final = re.compile(rf"{'|'.join(_NAMES.values())}|<(CR|LF)>|\\(x[0-9A-Fa-f]{{2}}|[rnt])")
"""A control character as messages and manuals show it, or as it stands between single quotes: no device says it so."""

_MOST_TRIED: Final = 2


def join_patterns(pieces: Sequence[str | Field], patterns: Sequence[str]) -> str:
    """Return one expression of the patterns of these pieces. Of open texts the last two may hold what follows them, those
    before end where it comes first: each way to part 128 blanks by four of them was 300 ms of the control loop."""
    tried = [k for k, piece in enumerate(pieces) if isinstance(piece, Text) and piece.is_open][-_MOST_TRIED:]
    joined = list(patterns)
    for k, piece in enumerate(pieces[:-1]):
        if isinstance(piece, Text) and piece.is_open and k not in tried:
            joined[k], joined[k + 1] = f"(?>{joined[k]}", f"{joined[k + 1]})"
    return "".join(joined)


def quote(text: str) -> str:
    """Return a sentence as a message shows it: '<STX>+  12.34 N'."""
    return repr(text.translate(_WITH_NAMES))


@dataclass(frozen=True, slots=True)
class Template:
    """Compiled by `compile_template`. may_be_blank names the one field whose blanks mean "no digits", nan as a value; has_text:
    one of the fields is free text."""

    text: str
    pieces: tuple[str | Field, ...]
    fields: tuple[Field, ...]
    pattern: re.Pattern[bytes]
    has_text: bool

    def field(self, name: str) -> Field | None:
        """Return the field of this name, None where the template has none."""
        return next((field for field in self.fields if field.name == name), None)

    def encode(self, values: Mapping[str, Value], may_be_blank: str = "") -> bytes:
        """Return the bytes of one sentence. A choice that is not given is its first word. ValueRefused when a value does not
        fit."""
        text = "".join(
            [piece if isinstance(piece, str) else _encode_field(piece, values, may_be_blank) for piece in self.pieces]
        )
        data = text.encode("ascii")
        if self.has_text and self.decode(data, may_be_blank) is None:
            raise ValueRefused(f"{quote(text)} could not be read back as {quote(self.text)}")
        return data

    def around(self, field: Field, values: Mapping[str, Value]) -> tuple[str, str]:
        """Return what stands before and behind one of the fields, all others spelled out with these values."""
        at = self.pieces.index(field)
        before, behind = (
            "".join(piece if isinstance(piece, str) else _encode_field(piece, values, "") for piece in part)
            for part in (self.pieces[:at], self.pieces[at + 1 :])
        )
        return before, behind

    def decode(self, data: bytes, may_be_blank: str = "") -> dict[str, Value] | None:
        """Return the values by field name, None when these bytes are not this sentence."""
        match = self.pattern.fullmatch(data)
        if match is None:
            return None
        values: dict[str, Value] = {}
        for field, part in zip(self.fields, match.groups(), strict=True):
            value = field.decode(part.decode("ascii"))
            if value is None or (isinstance(value, float) and isnan(value) and field.name != may_be_blank):
                return None
            values[field.name] = value
        return values


def _encode_field(field: Field, values: Mapping[str, Value], may_be_blank: str) -> str:
    value = values.get(field.name)
    if value is None and isinstance(field, Choice):
        return field.words[0]
    if value is None:
        raise ValueRefused(f"{field.name} is not given: say it under `constants`")
    if isinstance(field, Decimals) and field.name == may_be_blank and isinstance(value, float) and isnan(value):
        return field.blank
    return field.encode(value)


@cache
def compile_template(text: str) -> Template:
    """Return the template that this text means; TemplateError with a sentence for its author."""
    pieces = _pieces(text)
    _check(text, pieces)
    patterns = [re.escape(piece) if isinstance(piece, str) else f"({piece.pattern})" for piece in pieces]
    expression = join_patterns(pieces, patterns)
    fields = tuple(piece for piece in pieces if not isinstance(piece, str))
    has_text = any(isinstance(field, Text) for field in fields)
    return Template(text, tuple(pieces), fields, re.compile(expression.encode("ascii")), has_text)


def _pieces(text: str) -> list[str | Field]:
    pieces: list[str | Field] = []
    try:
        for literal, name, spec, conversion in Formatter().parse(text):
            if literal:
                pieces.append(literal)
            if name is not None:
                if not name.isidentifier() or conversion:
                    raise TemplateError(f"{quote(text)}: a field is {{name:shape}}", written=text)
                pieces.append(field_from(name, spec or ""))
    except TemplateError as error:
        raise TemplateError(str(error), written=text) from error
    except ValueError:  # a lone brace
        raise TemplateError(
            f"{quote(text)}: a field is {{name:shape}}; a brace that is sent itself is doubled, {{{{ or }}}}",
            written=text,
        ) from None
    return pieces


def _check(text: str, pieces: list[str | Field]) -> None:
    if not _TEXT.fullmatch(text):
        raise TemplateError(
            f"{text!r} is not printable text, SOH, STX, ETX, EOT, ENQ, ACK, NAK, ESC or tab (CR and LF at its end belong to "
            '`terminator`, ahead of an ETX too: "\\r\\x03")',
            written=text,
        )
    if spelt := _SPELT.search(text):
        raise TemplateError(
            f"{quote(text)}: {spelt[0]} would be {len(spelt[0])} characters on the wire. Between double quotes STX is "
            '"\\x02", ETX "\\x03", ENQ "\\x05", ACK "\\x06", ESC "\\x1b", a tab "\\t"; CR and LF at the end are the terminator',
            written=text,
        )
    names = [piece.name for piece in pieces if not isinstance(piece, str)]
    if len(set(names)) != len(names):
        raise TemplateError(f"{quote(text)} uses a field twice", written=text)
    for piece, following in pairwise(pieces):
        if not isinstance(piece, str) and piece.is_open and _runs_on(piece, following):
            raise TemplateError(
                f"{quote(text)}: nothing marks the end of {{{piece.name}}}; give it a width", written=text
            )


def _runs_on(piece: Field, following: str | Field) -> bool:
    """What follows an open field could be read as a part of it."""
    if not isinstance(following, str):
        return not isinstance(following, Choice)
    return following[0] in ("0123456789.+-eE" if isinstance(piece, Plain) else "0123456789.+-")
