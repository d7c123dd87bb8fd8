"""Who compiles the loops that all workers need."""

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import RLock
from typing import Any


class OneCompiler:
    """Lets one worker compile loops at a time: the others then find on disk what they, too, need. In a fresh clone all of them
    compiled the same for seconds, and at once. One loop may be compiled within another."""

    def __init__(self, file: Path) -> None:
        self._file, self._threads, self._depth = file, RLock(), 0

    def take_turns(self, dispatcher: Any) -> None:
        """dispatcher: numba's class of that name, which looks on disk before it compiles."""
        compile_now = dispatcher.compile

        def compile_in_turn(loop: Any, types: Any) -> Any:
            with self._turn():
                return compile_now(loop, types)

        dispatcher.compile = compile_in_turn

    @contextmanager
    def _turn(self) -> Iterator[None]:
        with self._threads, self._file.open("rb") as lock:
            if not self._depth:  # else this thread has it
                fcntl.flock(lock, fcntl.LOCK_EX)
            self._depth += 1
            try:
                yield
            finally:
                self._depth -= 1
