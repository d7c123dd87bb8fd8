"""One line of the audit: a JSON object that carries the hash of the line before it and its own.

`{"n": 17, "prev": HASH OF LINE 16, ..., "sha256": HASH OF THIS LINE WITHOUT ITS LAST FIELD}` in ASCII. A byte that is changed
breaks its own line, a line that is taken out or moved breaks the next. Whoever may write the directory may of course write
a whole new chain: keep the last hash elsewhere (`audit verify` prints it) where that matters.
"""

import json
from collections.abc import Mapping
from hashlib import sha256
from typing import Any, Final, NamedTuple

NO_HASH: Final = "0" * 64
"""What the first line names as the one before it."""
_SEAL: Final = ', "sha256": "'


class ChainEnd(NamedTuple):
    """The last line: its number (0: there is none) and its hash."""

    number: int = 0
    sha256: str = NO_HASH


class BrokenLine(ValueError):  # noqa: N818  reads as what it is
    """A line that is not as it was written; the message says what was seen."""


def seal_line(fields: Mapping[str, Any], before: ChainEnd) -> tuple[bytes, ChainEnd]:
    """Return the line of these fields after the line before, with its newline, and the chain's new end."""
    body = json.dumps({"n": before.number + 1, "prev": before.sha256, **fields}, allow_nan=False)
    own = sha256(body.encode("ascii")).hexdigest()
    return f'{body[:-1]}{_SEAL}{own}"}}\n'.encode("ascii"), ChainEnd(before.number + 1, own)


def open_line(line: bytes) -> tuple[dict[str, Any], ChainEnd]:
    """Return the fields of a line (without newline) and the chain's end with it. BrokenLine when its own hash does not fit."""
    try:
        text = line.decode("ascii")
    except UnicodeDecodeError:
        raise BrokenLine("holds bytes that are no text") from None
    body, seal, rest = text.rpartition(_SEAL)
    own = sha256(f"{body}}}".encode("ascii")).hexdigest()
    if not seal or rest != f'{own}"}}':
        raise BrokenLine("was changed: its own hash does not fit")
    try:
        fields: dict[str, Any] = json.loads(f"{body}}}")
    except (ValueError, RecursionError):
        raise BrokenLine("is no JSON, though its hash fits: somebody wrote it who knows how") from None
    number = fields.get("n") if isinstance(fields, dict) else None
    if not isinstance(number, int):
        raise BrokenLine("has no number")
    return fields, ChainEnd(number, own)


def check_link(fields: Mapping[str, Any], before: ChainEnd) -> None:
    """Check that a line follows the one before. BrokenLine says what is missing."""
    if (number := fields["n"]) != before.number + 1:
        missing = (
            f"line {before.number + 1} is missing" if number > before.number + 1 else "it stands in the wrong place"
        )
        raise BrokenLine(f"has number {number} after {before.number}: {missing}")
    if fields.get("prev") != before.sha256:
        raise BrokenLine("does not continue the line before it: that one was replaced")
