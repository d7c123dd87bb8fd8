"""The rows of the sample ring that the watch may compare: those in which the tool pushed, as the plant does that it knows."""

import numpy as np

from gateway.diagnosis.measurement import Floats
from gateway.recording.tables.row_validity import pulled_rows


def pushed_rows(data: bytes, columns: tuple[str, ...]) -> dict[str, Floats]:
    """Return these rows by column, without those of a pull: what is left has a gap there."""
    table = np.frombuffer(data, dtype="<f8").reshape(-1, len(columns))
    rows = {name: table[:, index] for index, name in enumerate(columns)}
    pulled = pulled_rows(rows)
    return {name: values[~pulled] for name, values in rows.items()} if pulled.any() else rows
