"""Bytes as a bad wire, a bad disk or a bad neighbour makes them, and how much an object holds."""

from collections.abc import Iterator
from random import Random


def damaged(data: bytes, chance: Random, most: int = 3) -> bytes:
    """Some bytes changed, lost, doubled, put in or cut off."""
    bad = bytearray(data)
    for _ in range(chance.randint(1, most)):
        at, way = chance.randrange(len(bad) + 1), chance.randrange(6)
        if way == 0:
            del bad[at : at + chance.randint(1, 4)]
        elif way == 1 and at < len(bad):
            bad[at] ^= 1 << chance.randrange(8)
        elif way == 2:
            bad[at:at] = chance.randbytes(chance.randint(1, 4))
        elif way == 3:
            bad[at:at] = bad[max(0, at - chance.randint(1, 20)) : at]
        elif way == 4 and at < len(bad):
            bad[at] = chance.choice(b"\x00\xff\x7f\x80\r\n,:-9 ")
        else:
            del bad[at:]
    return bytes(bad)


def pieces(stream: bytes, chance: Random) -> Iterator[bytes]:
    """The stream, cut at chance."""
    at = 0
    while at < len(stream):
        size = chance.choice((1, 2, 5, 13, 60, 400))
        yield stream[at : at + size]
        at += size


def held_bytes(thing: object, seen: set[int] | None = None) -> int:
    """Return how many bytes and list items an object of ours keeps, parts included."""
    seen = set() if seen is None else seen
    if id(thing) in seen or isinstance(thing, (type, int, float, str)) or callable(thing):
        return 0
    seen.add(id(thing))
    if isinstance(thing, (bytes, bytearray)):
        return len(thing)
    if isinstance(thing, (list, tuple, set, frozenset)):
        return len(thing) + sum(held_bytes(one, seen) for one in thing)
    if isinstance(thing, dict):
        return len(thing) + sum(held_bytes(one, seen) for one in thing.values())
    slots = [name for kind in type(thing).__mro__ for name in getattr(kind, "__slots__", ())]
    parts = [getattr(thing, name, None) for name in slots] + list(getattr(thing, "__dict__", {}).values())
    return sum(held_bytes(one, seen) for one in parts)
