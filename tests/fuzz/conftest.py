"""How many examples each kind of fuzz has: 200 000 together in the push gate, a hundred times as many with --long."""

from collections.abc import Callable
from random import Random
from typing import Final, NamedTuple

import pytest

PER_PUSH: Final = {
    "MBAP streams": 70_000,
    "bank requests": 60_000,
    "RTU bursts": 5_000,
    "codec chunks": 43_000,
    "staging writes": 8_000,
    "MQTT commands": 14_000,
    "YAML files": 400,
    "CSV files": 250,
    "recordings": 1_200,
    "Parquet files": 120,
    "workbooks": 40,
}
"""Requests to control.sock and rig.sock: tests/service/requests/test_hostile_requests.py, about 5 000 more."""
LONG: Final = 100
SEED: Final = 15


class Examples(NamedTuple):
    """count: how many this run makes; chance: seeded by the kind's name, so that one kind does not move another."""

    count: int
    chance: Random


@pytest.fixture
def examples(budget: int) -> Callable[..., Examples]:
    """Tell how many examples of a kind to make, and print it with its seed. parts: of how many tests."""

    def of(kind: str, parts: int = 1, part: object = 0) -> Examples:
        count = -(-PER_PUSH[kind] * (1 if budget == 1 else LONG) // parts)
        print(f"{count} {kind}, seed {SEED} {kind} {part}")
        return Examples(count, Random(f"{SEED} {kind} {part}"))

    return of
