"""Bytes as a bad wire, a bad disk or a bad neighbour makes them, and how much an object holds."""

from collections.abc import Iterator
from functools import cache
from random import Random
from typing import Any


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


def held_bytes(*things: object, beside: frozenset[int] = frozenset()) -> int:
    """Return how many bytes and list items objects of ours keep, parts included. beside: `parts_of` what does not count."""
    return _walk(things, set(beside))


def parts_of(thing: object) -> frozenset[int]:
    """Return the identities of an object's parts, for who asks again and again what others hold that share it."""
    seen = set[int]()
    _walk((thing,), seen)
    return frozenset(seen)


def _walk(things: tuple[object, ...], seen: set[int]) -> int:
    held, waiting = 0, list(things)
    while waiting:
        one = waiting.pop()
        kind: Any = type(one)
        if keeps_nothing(kind) or id(one) in seen or callable(one):
            continue
        seen.add(id(one))
        if isinstance(one, (bytes, bytearray)):
            held += len(one)
        elif isinstance(one, (list, tuple, set, frozenset)):
            held += len(one)
            waiting.extend(one)
        elif isinstance(one, dict):
            held += len(one)
            waiting.extend(one.values())
        else:
            waiting.extend(getattr(one, name, None) for name in slots_of(kind))
            waiting.extend(getattr(one, "__dict__", {}).values())
    return held


@cache
def keeps_nothing(kind: type) -> bool:
    return issubclass(kind, (type, int, float, str))


@cache
def slots_of(kind: type) -> list[str]:
    return [name for base in kind.__mro__ for name in getattr(base, "__slots__", ())]
