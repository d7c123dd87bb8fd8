"""What a user calls a recording and says of it; it stands in the recording's header, so that it goes wherever the file goes."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

LONGEST_NAME: Final = 60
LONGEST_NOTE: Final = 1000


@dataclass(frozen=True, slots=True)
class RecordingLabel:
    """name: one line; note: a sentence or more. Empty: nothing was said."""

    name: str = ""
    note: str = ""

    def as_header(self) -> dict[str, str]:
        """Return what of it stands in the header: only what was said."""
        return {key: value for key, value in (("name", self.name), ("note", self.note)) if value}


NO_LABEL: Final = RecordingLabel()


def check_name(text: str) -> str:
    """Check what a recording, or the calibration that comes of it, is to be called; return it on one line. ValueError, a
    sentence, for what is no name."""
    name = " ".join(text.split())
    if not name or not name.isprintable() or name.isdecimal() or len(name) > LONGEST_NAME:
        raise ValueError(f"{text!r} is no name: 1 to {LONGEST_NAME} printable characters, not a number alone")
    return name


def check_note(text: str) -> str:
    """Check what is to be said of a recording; return it as one paragraph. ValueError, a sentence, for what is no note."""
    note = " ".join(text.split())
    if not note or not note.isprintable() or len(note) > LONGEST_NOTE:
        raise ValueError(f"a note has 1 to {LONGEST_NOTE} printable characters")
    return note


def label_of(header: Mapping[str, Any]) -> RecordingLabel:
    """Return what the header of a recording says of it. A foreign table may have anything there."""
    return RecordingLabel(*(_text(header.get(key)) for key in ("name", "note")))


def _text(value: object) -> str:
    return value if isinstance(value, str) else ""
