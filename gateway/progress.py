"""What a long calculation is at, for whoever shows it: `report` and `advance` inside, `listen` around.

Nobody listens as a rule, and then a report costs a look at a variable. It belongs to the context (contextvars), so that two
calculations in one process do not hear each other. A process that does nothing but one calculation may hear everything
besides (`hear_everything`), whoever listens inside.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from typing import Final, TypeVar


@dataclass(frozen=True, slots=True)
class Progress:
    """What is being done, and how much of it is; of: 0 where nobody knows how much there is."""

    stage: str
    done: int = 0
    of: int = 0

    def __str__(self) -> str:
        return f"{self.stage}: {self.done} of {self.of}" if self.of else self.stage


Item = TypeVar("Item")
Listener = Callable[[Progress], None]
_listener: Final[ContextVar[Listener | None]] = ContextVar("listener", default=None)
_NOTHING: Final = Progress("")
_stage: Final[ContextVar[Progress]] = ContextVar("stage", default=_NOTHING)
_everything: Final[list[Listener]] = []
_NAMED: Final = 3


def report(stage: str, done: int = 0, of: int = 0) -> None:
    """Tell what is begun now. A listener may raise KeyboardInterrupt."""
    listeners = _listeners()
    if listeners:
        _stage.set(Progress(stage, done, of))
        _tell(listeners)


def advance(done: int, of: int) -> None:
    """Tell how far the present stage is."""
    listeners = _listeners()
    if listeners:
        _stage.set(replace(_stage.get(), done=done, of=of))
        _tell(listeners)


def hear_everything(listener: Listener) -> None:
    """Have everything that is reported in this process told to this listener, too, from now on."""
    _everything.append(listener)


def _listeners() -> tuple[Listener, ...]:
    listener = _listener.get()
    if listener is None and not _everything:
        return ()
    return (*_everything, listener) if listener else tuple(_everything)


def _tell(listeners: tuple[Listener, ...]) -> None:
    for listener in listeners:
        listener(_stage.get())


def reported(stage: str, items: Sequence[Item]) -> Iterator[Item]:
    """Yield the items of a stage, and tell before each how many are done; every item of a long calculation is worth a look."""
    for done, item in enumerate(items):
        report(stage, done, len(items))
        yield item


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
