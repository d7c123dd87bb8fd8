"""A disk that has done everything when it is asked: for tests in which nothing runs beside."""

from collections.abc import Callable
from typing import Any


class AtOnce:
    """Stands for `DiskWorker`: what it is given is done now."""

    def __call__(self, work: Callable[[], Any], done: Callable[[Any], None]) -> None:
        try:
            result = work()
        except Exception as error:
            result = error
        done(result)

    def begin(self, work: Callable[[], object]) -> None:
        work()

    def close(self) -> None: ...
