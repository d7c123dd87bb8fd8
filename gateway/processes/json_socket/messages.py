"""Requests and answers of a local socket as JSON: what is too large to be looked at, and what has no number in JSON."""

import json
import os
import re
from math import isfinite
from pathlib import Path
from typing import Any, Final

Answer = dict[str, Any]
LONGEST_ANSWER: Final = 1 << 20
"""Bytes of an answer: more are none of ours."""
_LONGEST_PATH: Final = 107  # bytes, of a Unix socket's address
_LONGEST_SENTENCE: Final = 500
_DEEPEST: Final = 10
_DEEPEST_READ: Final = 100  # lists and objects inside of each other; the reader has room for ten times as many
_BESIDE_BRACKETS: Final = re.compile(r'"[^"\\]*(?:\\.[^"\\]*)*"?|[^\[\]{}"]+', re.DOTALL)
_MOST_KEYS: Final = 64
_LONGEST_KEY: Final = 100
_MOST_VALUES: Final = 3000
_MOST_DIGITS: Final = 600  # in a row; the longest Modbus request in hex has 506
_DIGITS_AS_ZEROS: Final = bytes.maketrans(b"123456789", b"000000000")


def why_path_too_long(path: Path) -> str:
    """Return why no socket can be at this path, with the cure; empty where one can."""
    if (length := len(os.fsencode(path))) <= _LONGEST_PATH:
        return ""
    return f"{length} bytes of path, a socket takes {_LONGEST_PATH}: give a shorter --state DIR"


def error_answer(sentence: str) -> Answer:
    """Return the answer of a request that is refused, with the sentence that says why, cut to 500 characters."""
    if len(sentence) > _LONGEST_SENTENCE:
        sentence = f"{sentence[:_LONGEST_SENTENCE]} ..."
    return {"ok": False, "error": sentence}


def has_huge_number(line: bytes) -> bool:
    """Decide whether a text may hold a number of very many digits: to read one takes longer than to read as many others."""
    return b"0" * _MOST_DIGITS in line.translate(_DIGITS_AS_ZEROS)


def load_shallow(text: bytes, **hooks: Any) -> Any:
    """Return what a text from outside holds, read by json.loads with these hooks. ValueError for no JSON, and for
    what is nested more than 100 deep: garbage that is collected in the depth of a recursion has no room for its finalizers."""
    brackets = _BESIDE_BRACKETS.sub("", text.decode(json.detect_encoding(text), "replace"))
    depth = 0
    for bracket in brackets if len(brackets) > _DEEPEST_READ else "":
        depth += 1 if bracket in "[{" else -1
        if depth > _DEEPEST_READ:
            raise ValueError(f"nested more than {_DEEPEST_READ} deep")
    return json.loads(text, **hooks)


def why_too_large(request: Any) -> str:
    """Return why a request is larger than any that means something; empty for one that is not.

    Checking a shape and telling what is wrong with it takes its time for each key: what could take longer than a tick or
    two is not begun.
    """
    level, values = [request], 0
    for _ in range(_DEEPEST):
        below: list[Any] = []
        for value in level:
            if isinstance(value, dict):
                if len(value) > _MOST_KEYS or any(len(key) > _LONGEST_KEY for key in value):
                    return (
                        f"an object with more than {_MOST_KEYS} keys, or a key of more than {_LONGEST_KEY} characters"
                    )
                below += value.values()
            elif isinstance(value, list):
                below += value
        level, values = below, values + len(below)
        if values > _MOST_VALUES:
            return f"more than {_MOST_VALUES} values"
    return f"nested more than {_DEEPEST} deep" if level else ""


def encode_answer(answer: Answer) -> str:
    """Return the answer as JSON text. RFC 8259 has no NaN: what is not finite is null."""
    try:
        return json.dumps(answer, allow_nan=False)
    except ValueError:
        return json.dumps(_finite(answer), allow_nan=False)


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(part) for part in value]
    return None if isinstance(value, float) and not isfinite(value) else value


def refuse_constant(name: str) -> float:
    """Refuse NaN and Infinity, for json.loads(parse_constant=...)."""
    raise ValueError(f"{name} is no number")
