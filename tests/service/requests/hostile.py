"""Requests as nobody should send them: valid ones with a type or a value exchanged, and lines that are none. Seeded."""

import copy
import json
import random
from collections.abc import Iterator
from typing import Any

VALUES: list[Any] = [
    None, True, False, 0, 1, -1, 5, 2**31, 2**63, 10**30, 10**400, 0.5, -0.0, 1e300, 1e-300, float("nan"),
    float("inf"), float("-inf"), "", "x", "\x00", "\x1b[2J", "\ud800", "é" * 500, "x" * 20_000, "9" * 30, "nan",
    "../../etc/passwd", [], {}, [[]], [None], [1, "x", None, [2]], {"": 0}, {"a": {"b": {"c": {}}}}, [0] * 3000,
    {"do": "record"}, {"__class__": "x"}, [float("nan")], [10**400],
]  # fmt: skip
"""What a value may be exchanged for."""


def mutants(valid: list[dict[str, Any]], count: int, seed: int) -> Iterator[bytes]:
    """Lines: each a valid request with one or two changes."""
    chance = random.Random(seed)
    for _ in range(count):
        request: Any = copy.deepcopy(chance.choice(valid))
        for _ in range(chance.choice((1, 1, 2))):
            request = _changed(request, chance)
        yield json.dumps(request).encode()


def garbage(valid: list[dict[str, Any]], count: int, seed: int) -> Iterator[bytes]:
    """Lines that are no requests: cut, spliced, random and nested ones."""
    chance = random.Random(seed)
    yield from (b"", b"\x00", b"\xff\xfe", b"null", b"[]", b"{}", b'{"do":', b'{"do": NaN}', b'{"do": 1e999}')
    yield from (b"[" * 30_000 + b"]" * 30_000, b'{"do":' * 9_000 + b"1" + b"}" * 9_000, b"9" * 60_000)
    for request in valid:
        deep = json.dumps(request)[:-1].encode()
        for depth in (300, 900, 980, 5000):
            yield deep + b', "x": ' + b"[" * depth + b"]" * depth + b"}"
            yield deep + b', "plan": ' + b'{"a": ' * depth + b"1" + b"}" * depth + b"}"
            yield deep + b', "values": ' + b"[" * depth + b"]" * depth + b"}"
    for _ in range(count):
        line = bytearray(json.dumps(chance.choice(valid)).encode())
        for _ in range(chance.randint(1, 4)):
            at = chance.randrange(len(line) + 1)
            line[at : at + chance.randint(0, 3)] = chance.randbytes(chance.randint(0, 3))
        yield bytes(line).replace(b"\n", b"")


def _changed(request: Any, chance: random.Random) -> Any:
    places = list(_places(request))
    container, key = chance.choice(places) if places else (None, None)
    if container is None or chance.random() < 0.03:
        return chance.choice(VALUES)
    way = chance.random()
    if way < 0.7:
        container[key] = copy.deepcopy(chance.choice(VALUES))
    elif way < 0.85:
        container[key] = [container[key]] if chance.random() < 0.5 else {"x": container[key]}
    elif isinstance(container, dict):
        value = container.pop(key)
        if chance.random() < 0.5:
            container[f"{key}{chance.choice(['s', '', ' ', chr(0)])}"] = value
    else:
        del container[key]
    return request


def _places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Every (container, key) inside, but for the verb: what is sent to no handler tests none."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, part in tuple(items):
        if key != "do":
            yield value, key
            yield from _places(part)
