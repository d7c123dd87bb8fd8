"""What becomes of an answer on its way from a device to its host: cut, altered, doubled, late, lost, or something else instead.

Pure: what is spoiled, and how, is drawn with the events (draws/events.py); a `Cable` asks here what then arrives, and when.
"""

from dataclasses import dataclass
from typing import Final

Pieces = tuple[tuple[float, bytes], ...]
KINDS: Final = ("cut_front", "cut_end", "torn", "altered", "digit", "doubled", "late", "lost", "replaced", "followed")


@dataclass(frozen=True)
class Spoil:
    """One thing that the next `count` answers suffer. number: where, from 0 to 1; at `late`: how late, s. data: what stands in
    the place of the answer, or follows it."""

    kind: str
    count: int
    number: float = 0.0
    data: bytes = b""


def spoiled(spoil: Spoil, answer: bytes) -> Pieces:
    """Return what arrives of an answer: bytes, and how many seconds after they were due."""
    body = answer.rstrip(b"\r\n")
    end, place = answer[len(body) :], min(int(spoil.number * len(body)), max(0, len(body) - 1))
    match spoil.kind:
        case "cut_front":
            return ((0.0, body[place + 1 :] + end),)
        case "cut_end":
            return ((0.0, body[:place] + end),)
        case "torn":  # what is left is glued to the next answer
            return ((0.0, body[:place]),)
        case "altered":
            return ((0.0, _with_byte(answer, place, answer[place] ^ (1 << int(64 * spoil.number) % 8))),)
        case "digit":
            return ((0.0, _with_digit(answer, spoil.number)),)
        case "doubled":
            return ((0.0, answer), (0.0, answer))
        case "late":
            return ((spoil.number, answer),)
        case "lost":
            return ()
        case "replaced":
            return ((0.0, spoil.data),)
        case "followed":
            return ((0.0, answer), (0.0, spoil.data))
    raise AssertionError(spoil.kind)


def _with_byte(answer: bytes, place: int, byte: int) -> bytes:
    return answer[:place] + bytes((byte,)) + answer[place + 1 :]


def _with_digit(answer: bytes, number: float) -> bytes:
    """Return the answer with one of its digits another one; as it is where it has none."""
    places = [place for place, byte in enumerate(answer) if 48 <= byte <= 57]
    if not places:
        return answer
    place = places[min(int(number * len(places)), len(places) - 1)]
    return _with_byte(answer, place, 48 + (answer[place] - 47) % 10)
