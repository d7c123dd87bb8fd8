"""Sums in one order, whatever number of threads numpy's linear algebra would take.

OpenBLAS splits a long product over its threads and adds the parts: with two of them the last digits are others than with one. A
search asks thousands of times which of two models is better and ends when nothing is gained, so last digits grow: a recording's
gain differed in the fifth digit between two machines. What is computed side by side here stands for itself (side_by_side.py),
so one thread for each product costs nothing. Of numpy from PyPI, which brings its OpenBLAS along; any other is left as it is.
"""

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Final

import numpy as np

_PREFIXES: Final = ("scipy_openblas", "openblas")
_SUFFIXES: Final = ("64_", "")


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Have numpy's products in this block, and in all threads meanwhile, add their terms in the order of one thread."""
    count, choose = _thread_count()
    before = count()
    choose(1)
    try:
        yield
    finally:
        choose(before)


@cache
def _thread_count() -> tuple[Callable[[], int], Callable[[int], None]]:
    """How many threads numpy's OpenBLAS takes, and how to choose them; 1 and nothing where it brings none."""
    for path in sorted((Path(np.__file__).parent.parent / "numpy.libs").glob("*openblas*")):
        library = ctypes.CDLL(str(path))
        for prefix in _PREFIXES:
            for suffix in _SUFFIXES:
                names = [f"{prefix}_{way}_num_threads{suffix}" for way in ("get", "set")]
                if all(hasattr(library, name) for name in names):
                    count, choose = (getattr(library, name) for name in names)
                    choose.restype = None
                    return count, choose
    return lambda: 1, lambda _count: None
