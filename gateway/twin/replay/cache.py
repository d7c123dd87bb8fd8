"""Results kept between calls: the least recently used go when there is no more room."""

from collections import OrderedDict
from collections.abc import Hashable
from typing import Final

from gateway.twin.replay.drive import Floats

ROOM_BYTES: Final = 12_000_000
"""Per stage: 125 series of a minute at 200 Hz, more than a wave shares; four times as much is no faster."""


class Cache:
    """Series by what they depend on."""

    def __init__(self, room_bytes: int = ROOM_BYTES) -> None:
        self._kept: OrderedDict[Hashable, Floats] = OrderedDict()
        self._room_bytes, self._bytes = room_bytes, 0

    def get(self, key: Hashable) -> Floats | None:
        found = self._kept.get(key)
        if found is not None:
            self._kept.move_to_end(key)
        return found

    def put(self, key: Hashable, series: Floats) -> Floats:
        """Keep a series, which nobody may write to any more."""
        series.setflags(write=False)
        self._kept[key] = series
        self._bytes += series.nbytes
        while self._bytes > self._room_bytes and len(self._kept) > 1:
            self._bytes -= self._kept.popitem(last=False)[1].nbytes
        return series
