"""Dependencies: is an optional one installed, and what is said where one is needed and missing, or broken.

The extra `analysis` holds numba and pyarrow, more than all other dependencies together. A gateway that holds a force needs
neither; who compares recordings with the simulation needs the first, who reads or writes Parquet the second.
"""

import sys
from importlib import import_module
from importlib.util import find_spec
from traceback import walk_tb
from typing import Any, Final

ANALYSIS: Final = "analysis"
_EXTRA_OF: Final = {
    "numba": ANALYSIS,
    "openpyxl": ANALYSIS,
    "pyarrow": ANALYSIS,
    "distributed": "fleet",
    "prometheus_client": "metrics",
    "aiomqtt": "mqtt",
    "asyncua": "opcua",
}


class MissingExtraError(ImportError):
    """A library of an extra is not there, or does not load. The text begins with its code."""


def is_installed(library: str) -> bool:
    """Return whether a library is there, without importing it."""
    try:
        return find_spec(library) is not None
    except (ImportError, ValueError):
        return False


def require(library: str) -> None:
    """Raise MissingExtraError where a library of an extra is not installed; it is not imported."""
    if not is_installed(library):
        raise MissingExtraError(_sentence(library, "is not installed"), name=library)


def import_library(library: str) -> Any:
    """Return the imported library. MissingExtraError where it is not installed, or breaks while it is imported."""
    require(library)
    try:
        return import_module(library)
    except ImportError as error:
        raise MissingExtraError(_sentence(library, f"does not load ({error})"), name=library) from error


def missing_note(library: str, what: str) -> str:
    """Return the sentence on what is off for want of a library, for a log or a banner."""
    return _sentence(library, "is not installed", f"{what} is off: ")


def _sentence(library: str, state: str, effect: str = "") -> str:
    extra = _EXTRA_OF[library]
    needs = effect or "this needs more than is installed: "
    return f"E160 {needs}{library} {state}; pip install 'force-gateway[{extra}]' brings it"


def tell_broken_import(error: BaseException) -> str:
    """Return the sentence on a module that is missing, or that breaks while it is imported, whatever it raises then; empty for
    any other error."""
    if not (module := _broken_module(error)):
        return ""
    return f"E160 {module} is missing or broken ({type(error).__name__}: {error}): install it anew in {sys.prefix}"


def _broken_module(error: BaseException) -> str:
    if isinstance(error, SyntaxError) and error.filename:
        return error.filename
    if isinstance(error, ImportError) and error.name:
        return error.name
    running = [frame for frame, _ in walk_tb(error.__traceback__) if frame.f_code.co_name == "<module>"]
    imported = [name for frame in running if (name := str(frame.f_globals.get("__name__"))) != "__main__"]
    return imported[-1] if imported else ""
