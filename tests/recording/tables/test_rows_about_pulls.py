"""Which rows a plant that only pushes can say nothing of: a pull, the turns of the valve, what friction remembers behind it."""

import numpy as np
import pytest

from gateway.recording.tables.column_names import DERIVED
from gateway.recording.tables.row_validity import rows_about_pulls

STEP_S = 0.1


def columns_of(*parts: tuple[float, float, bool]) -> dict[str, np.ndarray]:
    """Rows of 0.1 s. parts: (seconds, volts, whether the tool pulled), one after the other."""
    counts = [round(seconds / STEP_S) for seconds, _, _ in parts]
    command_v = np.repeat([volts for _, volts, _ in parts], counts)
    pulling = np.repeat([float(pulls) for _, _, pulls in parts], counts)
    none = {name: np.zeros(command_v.size) for name in DERIVED}
    return none | {"time_s": STEP_S * np.arange(command_v.size), "command_v": command_v, "pulling": pulling}


def left_out_s(columns: dict[str, np.ndarray]) -> list[tuple[float, float]]:
    """From when until when nothing is judged."""
    edges = np.flatnonzero(np.diff(rows_about_pulls(columns).astype(int), prepend=0, append=0))
    return [(round(STEP_S * first, 3), round(STEP_S * stop, 3)) for first, stop in edges.reshape(-1, 2)]


REST, PULLED = (1.0, 0.0, False), (3.0, 2.0, True)


@pytest.mark.parametrize(
    ("parts", "left_out"),
    [
        (((5.0, 2.0, False),), []),
        (((5.0, 2.0, False), REST, PULLED), [(5.0, 9.0)]),
        ((PULLED, REST, (2.0, 1.0, False), (2.0, 3.0, False), (5.0, 1.0, False)), [(0.0, 6.1)]),
        ((PULLED, REST, (20.0, 1.0, False), (2.0, 3.0, False)), [(0.0, 4.1)]),  # for twelve seconds at most
        (((5.0, 2.0, False), REST, PULLED, REST, (5.0, 2.0, False), REST, PULLED), [(5.0, 10.1), (15.0, 19.0)]),
        ((PULLED,), [(0.0, 3.0)]),
        (((5.0, 2.0, False), REST, PULLED, REST, (5.0, 1.0, False), (5.0, 3.0, False)), [(5.0, 15.1)]),
        ((PULLED, REST, (5.0, 2.0, False), REST), [(0.0, 4.1)]),
    ],
    ids=["none", "at the end", "at the start", "higher much later", "twice", "alone", "higher soon", "rest at the end"],
)
def test_a_pull_takes_the_rest_before_and_the_rise_behind_with_it(
    parts: tuple[tuple[float, float, bool], ...], left_out: list[tuple[float, float]]
) -> None:
    """Of a healthy machine that pulled and pushed in turn 0.17 to 0.35 N were left that no effect explained."""
    assert left_out_s(columns_of(*parts)) == left_out


def test_without_a_command_the_pull_alone_is_known() -> None:
    columns = columns_of((5.0, 2.0, False), REST, PULLED)
    del columns["command_v"]
    assert left_out_s(columns) == [(6.0, 9.0)]


def test_a_command_that_is_missing_is_none_that_presses() -> None:
    columns = columns_of((5.0, 2.0, False), REST, PULLED, REST, (5.0, 2.0, False))
    columns["command_v"][[55, 95]] = np.nan
    assert left_out_s(columns) == [(5.0, 10.1)]
