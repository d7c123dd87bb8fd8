"""The newest rows of the sample ring as columns, for processes beside control: each new row once, or the last ones again."""

from typing import Any

import numpy as np

from gateway.recording.ring import RingReader

Columns = dict[str, "np.ndarray[Any, np.dtype[np.float64]]"]


class RingRows:
    """Reads a ring. descriptor: of its memory, as the guardian hands it on."""

    def __init__(self, descriptor: int) -> None:
        self._ring = RingReader(descriptor)
        self._seen = 0

    def newest(self, rows: int) -> Columns:
        """Return at most this many of the newest rows, oldest first, by column; empty before control has written any."""
        return _columns(self._ring, rows)

    def fresh(self, most_rows: int) -> Columns:
        """Return the rows that came since the last call, the newest `most_rows` where there are more; empty where none did."""
        written = self._ring.rows_written - 1  # the newest one is not read yet, see RingReader
        missing, self._seen = written - self._seen, max(written, 0)
        if missing < 0:  # another ring
            missing = written
        return _columns(self._ring, min(missing, most_rows)) if missing > 0 else {}

    def close(self) -> None:
        """Close the memory."""
        self._ring.close()


def _columns(ring: RingReader, rows: int) -> Columns:
    data = ring.newest(rows)
    if not data:
        return {}
    table = np.frombuffer(data, "<f8").reshape(-1, len(ring.columns))
    return {name: table[:, place] for place, name in enumerate(ring.columns)}
