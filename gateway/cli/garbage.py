"""Of a command of seconds, looking for garbage takes a tenth, and as much again at its end, when all memory goes anyway."""

import atexit
import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def spared_garbage_collection() -> Iterator[None]:
    """Have nobody look for cycles in this block, nor for those that are left when the process ends."""
    was_on = gc.isenabled()
    gc.disable()
    atexit.register(gc.freeze)
    try:
        yield
    finally:
        if was_on:
            gc.enable()
