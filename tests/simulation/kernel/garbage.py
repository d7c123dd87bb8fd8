"""When a schedule's garbage is collected."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def garbage_left_alone() -> Iterator[None]:
    """Collect none inside, but behind it. In the depth of a recursion, that of a nested JSON say, the coroutines of a process
    that was killed could not be closed: each was a RecursionError that nobody expects, once in many runs of the gate."""
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
