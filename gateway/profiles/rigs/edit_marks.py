"""Lines of a rig file that are still marked EDIT: `init` writes the mark, the owner takes it away with his own value.

A mark is a comment that begins with EDIT, behind a value or on the line above it; what follows says what belongs there.
"""

import re
from collections.abc import Iterator
from typing import Final

from gateway.profiles.strict_yaml.faults import ProfileFault
from gateway.profiles.strict_yaml.text import Document

_MARK: Final = re.compile(r"#\s*EDIT\b[:,]?\s*(.*)")
PLACEHOLDER: Final = re.compile(r"\bEDIT\b")
"""In a value that cannot stay as it is, such as the path of a port."""


def find_edit_marks(document: Document, text: str) -> Iterator[ProfileFault]:
    """Yield each value whose line is still marked, with what belongs there."""
    keys = {mark.key_line: path for path, mark in document.marks.items() if path}
    for number, line in enumerate(text.splitlines(), start=1):
        if match := _MARK.search(line):
            at = number if line.split("#", 1)[0].strip() else number + 1
            if at in keys:
                what = f": {match[1]}" if match[1] else ""
                yield document.fault(keys[at], f"is still marked EDIT{what}; when it is yours, take the mark away")
