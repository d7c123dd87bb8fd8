"""Threads that the scene lets go on: each does what it was given in its order, when its turn is drawn."""

from collections import deque
from collections.abc import Callable
from typing import Any, ClassVar

from gateway.calibrations.activation import UnusableCalibration
from gateway.numbered_documents.store import StoreError

Work = Callable[[], Any]


class DrawnWorker:
    """Stands for `DiskWorker`. raised: what no disk and no store raises, and nobody would have seen."""

    all: ClassVar[list["DrawnWorker"]] = []
    raised: ClassVar[list[Exception]] = []

    def __init__(self) -> None:
        self._waiting: deque[tuple[Work, Callable[[Any], None]]] = deque()
        self.all.append(self)

    def __call__(self, work: Work, done: Callable[[Any], None]) -> None:
        self._waiting.append((work, done))

    def begin(self, work: Work) -> None:
        self._waiting.append((work, lambda result: None))

    def close(self) -> None: ...

    def has_work(self) -> bool:
        """Something waits."""
        return bool(self._waiting)

    def go_on(self) -> None:
        """Do the next thing."""
        work, done = self._waiting.popleft()
        try:
            result = work()
        except Exception as error:
            result = error
            if not isinstance(error, OSError | StoreError | UnusableCalibration):
                self.raised.append(error)
        done(result)

    @classmethod
    def busy(cls) -> list["DrawnWorker"]:
        """Those that have something to do."""
        return [one for one in cls.all if one.has_work()]
