"""Run a function over many things on two processor cores.

For work that lets go of Python's lock: compiled loops and numpy's own on long arrays. What comes out does not depend on which
core did what: every call stands for itself. Two, because that is what a controller's computer has to spare.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TypeVar

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")


def side_by_side(function: Callable[[_Item], _Result], items: Sequence[_Item]) -> list[_Result]:
    """Return the function of each item, in order; every second one is done by another thread meanwhile."""
    if len(items) < 2:
        return [function(item) for item in items]
    others = _helper().submit(lambda: [function(item) for item in items[1::2]])
    try:
        own = [function(item) for item in items[::2]]
    finally:
        found = others.result()
    return [result for pair in zip(own, found, strict=False) for result in pair] + own[len(found) :]


@cache
def _helper() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(1, "helper")
