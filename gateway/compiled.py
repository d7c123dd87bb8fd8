"""Run loops over arrays as machine code, compiled by numba when they are first called, and kept on disk.

A `step` is a plain function of floats and named tuples: the running twin calls it as it stands, compiled loops call the very
same function. A `loop` walks over arrays. numba belongs to the extra `analysis`: it is imported by the first call of a loop,
so that a process which never searches does not load it.

numba keeps compiled loops by the file they stand in, and does not see that a step in another file has changed. So they
are kept in a folder of their own per state of all steps, beside Python's bytecode (or where NUMBA_CACHE_DIR says).
"""

import hashlib
from collections.abc import Callable
from functools import cache, wraps
from pathlib import Path
from types import CodeType
from typing import Any, Final, ParamSpec, TypeVar

from gateway.extras import import_library

_Parameters = ParamSpec("_Parameters")
_Result = TypeVar("_Result")
_steps: Final[list[Callable[..., Any]]] = []


def step(function: Callable[_Parameters, _Result]) -> Callable[_Parameters, _Result]:
    """Let compiled loops call this function; for everybody else it stays the plain function that it is."""
    _steps.append(function)
    return function


def loop(function: Callable[_Parameters, _Result]) -> Callable[_Parameters, _Result]:
    """Compile a function when it is first called. MissingExtraError, then, where numba is not installed.

    Its arguments are numbers, named tuples of numbers and contiguous arrays; it calls steps and numpy's scalar functions.
    """

    @cache
    def compiled() -> Callable[_Parameters, _Result]:
        return _compile(function)

    @wraps(function)
    def run(*arguments: _Parameters.args, **named: _Parameters.kwargs) -> _Result:
        return compiled()(*arguments, **named)

    return run


def _compile(function: Callable[_Parameters, _Result]) -> Callable[_Parameters, _Result]:
    compiled: Callable[_Parameters, _Result] = _numba().njit(cache=True, nogil=True, error_model="numpy")(function)
    return compiled


@cache
def _numba() -> Any:
    """numba, with all steps made known to it."""
    import_library("numba")
    import numba
    from numba.extending import register_jitable

    chosen = numba.config.CACHE_DIR  # type: ignore[attr-defined]
    kept = Path(chosen) if chosen else Path(__file__).parent / "__pycache__"
    numba.config.CACHE_DIR = str(kept / f"compiled-{_fingerprint()}")  # type: ignore[attr-defined]
    for function in _steps:
        register_jitable(error_model="numpy")(function)
    return numba


def _fingerprint() -> str:
    """Name the state of all steps."""
    digest = hashlib.sha256()
    for function in sorted(_steps, key=lambda one: (one.__module__, one.__qualname__)):
        digest.update(repr((_content(function.__code__), _constants(function))).encode())
    return digest.hexdigest()[:16]


def _content(code: CodeType) -> tuple[Any, ...]:
    constants = [_content(one) if isinstance(one, CodeType) else one for one in code.co_consts]
    return (code.co_name, code.co_code, constants, code.co_names)


def _constants(function: Callable[..., Any]) -> list[Any]:
    """Return what a compiled function takes for constant: numbers of its module, and the fields of its named tuples."""
    found = [function.__globals__.get(name) for name in function.__code__.co_names]
    return [value if isinstance(value, int | float) else getattr(value, "_fields", None) for value in found]
