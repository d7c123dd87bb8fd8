"""Results kept between calls: the least recently used go when there is no more room."""

from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from typing import Final, TypeVar

from gateway.side_by_side import side_by_side
from gateway.twin.replay.drive import Floats

_room: Final[ContextVar[int | None]] = ContextVar("room", default=None)
_Key = TypeVar("_Key", bound=Hashable)
ROOM_BYTES: Final = 12_000_000
"""Per stage: 125 series of a minute at 200 Hz, more than a wave shares; four times as much is no faster."""


@contextmanager
def room_for_series(room_bytes: int) -> Iterator[None]:
    """Have each stage of replays made in this block keep so much at most: for whoever must not be felt."""
    token = _room.set(room_bytes)
    try:
        yield
    finally:
        _room.reset(token)


def room_bytes_now() -> int:
    """Return how much each stage of a replay that is made now keeps at most."""
    return _room.get() or ROOM_BYTES


def numbers_at_once() -> int:
    """Return how many float64 of one kind a calculation of many series holds at a time: one stage's room."""
    return room_bytes_now() // 8


class Cache:
    """Series by what they depend on."""

    def __init__(self) -> None:
        self._kept: OrderedDict[Hashable, Floats] = OrderedDict()
        self._room_bytes, self._bytes = room_bytes_now(), 0

    def get(self, key: Hashable) -> Floats | None:
        """Return the series of a key; None where it is not kept (any more)."""
        found = self._kept.get(key)
        if found is not None:
            with suppress(KeyError):  # another thread has made room since
                self._kept.move_to_end(key)
        return found

    def get_all(self, keys: Sequence[_Key], make: Callable[[_Key], Floats]) -> list[Floats]:
        """Return the series of different keys; those that are not kept are made, side by side."""
        found = {key: self.get(key) for key in keys}
        missing = [key for key, series in found.items() if series is None]
        for key, series in zip(missing, side_by_side(make, missing), strict=True):
            found[key] = self.put(key, series)
        return [series for series in found.values() if series is not None]

    def put(self, key: Hashable, series: Floats) -> Floats:
        """Keep a series, which nobody may write to any more."""
        series.setflags(write=False)
        self._kept[key] = series
        self._bytes += series.nbytes
        while self._bytes > self._room_bytes and len(self._kept) > 1:
            self._bytes -= self._kept.popitem(last=False)[1].nbytes
        return series
