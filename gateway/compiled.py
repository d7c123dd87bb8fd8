"""Run loops over arrays as machine code, compiled by numba when they are first called, and kept on disk.

A `step` is a plain function of floats and named tuples: the running twin calls it as it stands, compiled loops call the very
same function. A `loop` walks over arrays. numba belongs to the extra `analysis`: it is imported by the first call of a loop,
so that a process which never searches does not load it.

numba keeps compiled loops by the file they stand in, and does not see that a step in another file has changed. So they
are kept in a folder of their own per state of all steps and loops, in the folder of `compiled_folder`. Where files are not
taken (any more), loops are compiled anew in each process.
"""

import hashlib
import importlib
import inspect
import sys
from collections.abc import Callable
from functools import cache, wraps
from pathlib import Path
from threading import Lock
from typing import Any, Final, ParamSpec, TypeVar

from gateway import progress
from gateway.compiled_folder import find_folder
from gateway.extras import import_library

_Parameters = ParamSpec("_Parameters")
_Result = TypeVar("_Result")
_steps: Final[list[Callable[..., Any]]] = []
_loops: Final[list[Callable[..., Any]]] = []
_unregistered: Final[list[Callable[..., Any]]] = []  # steps that numba does not know yet
_unkept: Final[set[Callable[..., Any]]] = set()
_one_at_a_time: Final = Lock()
_LINEAR_ALGEBRA: Final = ("scipy.linalg", "scipy.linalg.cython_blas")
PREPARING: Final = "preparing the simulation for this machine, once"
"""What is reported while loops are compiled, as which of all loops that there are."""


def step(function: Callable[_Parameters, _Result]) -> Callable[_Parameters, _Result]:
    """Let compiled loops call this function; for everybody else it stays the plain function that it is."""
    _steps.append(function)
    _unregistered.append(function)
    return function


def loop(function: Callable[_Parameters, _Result]) -> Callable[_Parameters, _Result]:
    """Compile a function when it is first called. MissingExtraError, then, where numba is not installed.

    Its arguments are numbers, named tuples of numbers and contiguous arrays; it calls steps and numpy's scalar functions.
    """

    _loops.append(function)

    @wraps(function)
    def run(*arguments: _Parameters.args, **named: _Parameters.kwargs) -> _Result:
        result: _Result
        try:
            result = _compile(function, function not in _unkept)(*arguments, **named)
        except OSError:  # of the folder, which is full or gone: loops themselves read and write nothing
            _unkept.add(function)
            result = _compile(function, False)(*arguments, **named)
        return result

    return run


def _compile(function: Callable[_Parameters, _Result], is_kept: bool) -> Callable[_Parameters, _Result]:
    """Return the function with a compiler before it, the same one to all threads: it has compiled for some types already."""
    with _one_at_a_time:
        return _compiler_of(function, is_kept)


@cache
def _compiler_of(function: Callable[_Parameters, _Result], is_kept: bool) -> Callable[_Parameters, _Result]:
    """Make it: what it compiles for the types of its arguments is kept on disk. All steps that it may call are known by now,
    for its module has imported them; modules that come later bring more."""
    numba, folder = _numba()
    while _unregistered:
        numba.extending.register_jitable(error_model="numpy")(_unregistered.pop())
    if folder:
        numba.config.CACHE_DIR = str(folder / f"compiled-{_fingerprint(len(_steps), len(_loops))}")
    compiler = numba.njit(cache=is_kept and folder is not None, nogil=True, error_model="numpy")
    compiled: Callable[_Parameters, _Result] = compiler(function)
    return compiled


@cache
def _numba() -> tuple[Any, Path | None]:
    """Return numba, and the folder of folders for what it compiles; None where there is none."""
    numba = _import_numba()
    from numba.core import event

    _report_compilations(event)
    return numba, find_folder(numba.config.CACHE_DIR, Path(__file__).parent)


def _import_numba() -> Any:
    """Return numba without scipy's linear algebra, which it looks for at its import: no loop multiplies matrices, and half of
    the time until the first loop runs would go there."""
    blocked = not any(name in sys.modules for name in _LINEAR_ALGEBRA)
    try:
        sys.modules.update(dict.fromkeys(_LINEAR_ALGEBRA) if blocked else {})  # type: ignore[arg-type]  # None: not there
        numba = import_library("numba")
        for name in ("numba.np.arraymath", "numba.extending"):
            importlib.import_module(name)
    finally:
        for name in _LINEAR_ALGEBRA if blocked else ():
            del sys.modules[name]
    return numba


def _report_compilations(event: Any) -> None:
    """Have numba report what it compiles; it tells of compilations within others, too. event: its module of that name."""
    begun: list[progress.Progress] = []
    compiled: set[Any] = set()

    class Listener(event.Listener):  # type: ignore[misc]  # numba is imported late
        def on_start(self, event: Any) -> None:
            begun.append(progress.current())
            if len(begun) == 1:
                compiled.add(event.data["dispatcher"].py_func)
                progress.report(PREPARING, min(len(compiled), len(_loops)), len(_loops))

        def on_end(self, event: Any) -> None:
            before = begun.pop()
            if not begun:
                progress.resume(before)

    event.register("numba:compile", Listener())


@cache
def _fingerprint(steps: int, loops: int) -> str:
    """Name the state of all steps and loops, of which there are so many by now: the modules that they stand in, where a type
    that is renamed stands too, for what is kept of it cannot be read under another name; and the numbers that steps have from
    elsewhere."""
    digest = hashlib.sha256()
    for name in sorted({function.__module__ for function in [*_steps, *_loops]}):
        digest.update(inspect.getsource(sys.modules[name]).encode())
    for function in sorted(_steps, key=lambda one: (one.__module__, one.__qualname__)):
        digest.update(repr(_constants(function)).encode())
    return digest.hexdigest()[:16]


def _constants(function: Callable[..., Any]) -> list[Any]:
    """Return what a compiled function takes for constant: numbers of its module, and the fields of its named tuples."""
    found = [function.__globals__.get(name) for name in function.__code__.co_names]
    return [value if isinstance(value, int | float) else getattr(value, "_fields", None) for value in found]
