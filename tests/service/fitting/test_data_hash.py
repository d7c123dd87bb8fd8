"""The hash by which a fit is known again covers all that the fit has used."""

from types import SimpleNamespace
from typing import Any

import pytest

from gateway.service.fitting.ladder_fit import data_sha256

POINTS: dict[str, Any] = {"voltage_v": [1.0, 2.0], "force_n": [7.0, 14.0], "direction": [1, -1], "group": [0, 1]}
WALK: dict[str, Any] = {"minor_v": [1.5, 1.2], "minor_n": [10.0, 9.0]}


def hash_of(**changes: Any) -> str:
    given = POINTS | WALK | changes
    ladder = SimpleNamespace(**{name: given[name] for name in POINTS})
    return data_sha256(SimpleNamespace(ladder=ladder, **{name: given[name] for name in WALK}))  # type: ignore[arg-type]


@pytest.mark.parametrize("name", [*POINTS, *WALK])
def test_another_number_anywhere_is_another_fit(name: str) -> None:
    values = (POINTS | WALK)[name]
    assert hash_of() == hash_of(**{name: list(values)}) != hash_of(**{name: [values[0], values[1] + 1]})
