"""Which addresses of a process are a library's code, and whether the cell was read then as it is now."""

from dataclasses import asdict
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.control.compensation.cell_map import CellMap
from gateway.watch import described_machine, memory

MAPS = """\
55d0-55e0 r-xp 00000000 08:01 1 /usr/bin/python3
7f00-7f40 r--p 00000000 08:01 2 /usr/lib/libllvmlite.so
7f40-7f80 r-xp 00040000 08:01 2 /usr/lib/a folder/libllvmlite.so
7f80-7fc0 rwxp 00040000 08:01 2 /usr/lib/libllvmlite.so
7fc0-7fd0 r-xp 00000000 08:01 3 /usr/lib/libllvmlite/libother.so
8000-8010 r-xp 00000000 00:00 0
"""


def test_only_what_nobody_can_have_written_to_is_given_back() -> None:
    assert list(memory._code_of("libllvmlite", MAPS)) == [(0x7F40, 0x7F80)]


@pytest.mark.parametrize(
    ("then", "now", "alike"),
    [
        (None, None, True),
        ({}, None, True),
        (CellMap(quadratic_per_n=1e-3), CellMap(quadratic_per_n=1e-3), True),
        (CellMap(quadratic_per_n=1e-3), None, False),
        (None, CellMap(quadratic_per_n=1e-3), False),
        (CellMap(quadratic_per_n=1e-3), CellMap(quadratic_per_n=2e-3), False),
    ],
)
def test_a_reference_is_compared_with_where_its_readings_were_straightened_alike(
    then: Any, now: CellMap | None, alike: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    header = {"cell": asdict(then) if isinstance(then, CellMap) else then}
    monkeypatch.setattr(described_machine, "reference_path", lambda *_: None)
    monkeypatch.setattr(described_machine, "read_table", lambda path: SimpleNamespace(header=header))
    monkeypatch.setattr(described_machine, "header_in_use", lambda given: given)
    state: Any = None
    assert described_machine.is_straightened_alike(state, state, now) is alike
