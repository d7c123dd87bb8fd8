"""Run a function over many things on two processor cores.

For work that lets go of Python's lock: compiled loops and numpy's own on long arrays. What comes out does not depend on which
core did what: every call stands for itself. Two, because that is what a controller's computer has to spare.
"""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from typing import Final, TypeVar

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")
_is_inside: Final[ContextVar[bool]] = ContextVar("is_inside", default=False)


def side_by_side(function: Callable[[_Item], _Result], items: Sequence[_Item]) -> list[_Result]:
    """Return the function of each item, in order; every second one is done by another thread meanwhile, unless this is
    called within such a call."""
    if len(items) < 2 or _is_inside.get():
        return [function(item) for item in items]
    others = _helper().submit(_call_each, function, items[1::2])
    try:
        own = _call_each(function, items[::2])
    finally:
        found = others.result()
    return [result for pair in zip(own, found, strict=False) for result in pair] + own[len(found) :]


@contextmanager
def one_after_another() -> Iterator[None]:
    """Have everything in this block done by the one thread that asks for it: for whoever must not be felt."""
    token = _is_inside.set(True)
    try:
        yield
    finally:
        _is_inside.reset(token)


def _call_each(function: Callable[[_Item], _Result], items: Sequence[_Item]) -> list[_Result]:
    with one_after_another():
        return [function(item) for item in items]


@cache
def _helper() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(1, "helper")
