"""What may stand behind the last line that was synced: lines that a killed process has written, and after a power cut whatever
the disk had taken of them, pieces and holes of zeros, a later one without an earlier.

The head names the last line that is on the disk for certain. Behind it the chain holds as far as it holds; what follows has
been promised to nobody, and whoever may write there could take it away unseen as well.
"""

import os
from pathlib import Path
from typing import Final, NamedTuple

from gateway.audit.chain import BrokenLine, ChainEnd, check_link, open_line
from gateway.audit.file_lines import iterate_lines
from gateway.plain_file import open_plain_stream

_LONGEST_QUOTE: Final = 400


class TornEnd(NamedTuple):
    """What was cut off: a sentence, and how it began."""

    text: str
    quote: str


def cut_unsynced(path: Path, head: ChainEnd | None) -> TornEnd | None:
    """Cut off what does not hold at the end of a file, behind the line that the head names; None where all holds. What does not
    hold up to that line stays, as evidence. Without a head only an incomplete last line goes."""
    size, whole = path.stat().st_size, _bytes_that_hold(path, head)
    if whole == size:
        return None
    with open_plain_stream(path) as stream:
        stream.seek(whole)
        torn = stream.read(_LONGEST_QUOTE)
    os.truncate(path, whole)
    cut = f"{size - whole} bytes behind the last line that holds were cut off: a writer was killed, or the power failed"
    return TornEnd(cut, torn.decode("ascii", "backslashreplace"))


def _bytes_that_hold(path: Path, head: ChainEnd | None) -> int:
    """Return how much of a file is whole lines, of those behind the head only such as continue the one before."""
    number, at = int(path.stem) - 1, 0
    before = head if head and head.number == number else None
    for line in iterate_lines(path):
        number += 1
        if not line.is_whole:
            break
        if head and number >= head.number:
            try:
                fields, own = open_line(line.text)
                if before:
                    check_link(fields, before)
            except BrokenLine:
                if number > head.number:
                    break
                own = None
            if number == head.number and own != head:
                head = None  # altered: nothing is known of what stands behind
            before = own
        at += line.length + 1
    return at
