"""What a long calculation is at, for whoever shows it: `report` and `advance` inside, `listen` around.

Nobody listens as a rule, and then a report costs a look at a variable. It belongs to the context (contextvars), so that two
calculations in one process do not hear each other.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from typing import Final


@dataclass(frozen=True, slots=True)
class Progress:
    """What is being done, and how much of it is; of: 0 where nobody knows how much there is."""

    stage: str
    done: int = 0
    of: int = 0

    def __str__(self) -> str:
        return f"{self.stage}: {self.done} of {self.of}" if self.of else self.stage


Listener = Callable[[Progress], None]
_listener: Final[ContextVar[Listener | None]] = ContextVar("listener", default=None)
_NOTHING: Final = Progress("")
_stage: Final[ContextVar[Progress]] = ContextVar("stage", default=_NOTHING)
_NAMED: Final = 3


def report(stage: str, done: int = 0, of: int = 0) -> None:
    """Tell what is begun now. A listener may raise KeyboardInterrupt."""
    if listener := _listener.get():
        _stage.set(Progress(stage, done, of))
        listener(_stage.get())


def advance(done: int, of: int) -> None:
    """Tell how far the present stage is."""
    if listener := _listener.get():
        _stage.set(replace(_stage.get(), done=done, of=of))
        listener(_stage.get())


@contextmanager
def listen(listener: Listener) -> Iterator[None]:
    """Have everything that is reported in this block told to a listener."""
    token = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(token)


def current() -> Progress:
    """Return what was told last, for `resume`."""
    return _stage.get()


def resume(before: Progress) -> None:
    """Tell that something goes on after what came in between."""
    report(before.stage, before.done, before.of)


def few(names: Sequence[str]) -> str:
    """Return the first few different names, and how many more there are."""
    different = list(dict.fromkeys(names))
    more = len(different) - _NAMED
    return ", ".join(different[:_NAMED]) + (f" and {more} more" if more > 0 else "")
