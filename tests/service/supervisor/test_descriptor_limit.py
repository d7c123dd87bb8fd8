"""A limit on open files is raised where it may be, and told at the start where it stays too low for a gateway."""

import json
import resource
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from gateway.service.supervisor import descriptor_limit, guardian
from gateway.service.supervisor.descriptor_limit import NEEDED, WANTED, raise_descriptor_limit
from gateway.service.supervisor.run_options import RunOptions

INFINITE = resource.RLIM_INFINITY
Limits = list[tuple[int, int]]


@pytest.fixture
def limits(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[int, int], Limits]]:
    """limits(soft, hard): what this process is told it has; the list that comes back grows with what it sets."""
    set_to: Limits = []

    def are(soft: int, hard: int) -> Limits:
        monkeypatch.setattr(descriptor_limit.resource, "getrlimit", lambda which: (soft, hard))
        monkeypatch.setattr(descriptor_limit.resource, "setrlimit", lambda which, pair: set_to.append(pair))
        return set_to

    return are


@pytest.mark.parametrize("hard", [WANTED, 4096, INFINITE])
@pytest.mark.parametrize("soft", [16, NEEDED - 1, NEEDED, WANTED - 1])
def test_a_low_soft_limit_is_raised_and_not_told(limits: Callable[[int, int], Limits], soft: int, hard: int) -> None:
    set_to = limits(soft, hard)
    assert raise_descriptor_limit() == ""
    assert set_to == [(WANTED, hard)]


@pytest.mark.parametrize("soft", [WANTED, 1 << 20, INFINITE])
def test_what_is_enough_is_left_as_it_is(limits: Callable[[int, int], Limits], soft: int) -> None:
    set_to = limits(soft, INFINITE)
    assert raise_descriptor_limit() == ""
    assert not set_to


@pytest.mark.parametrize("hard", [NEEDED, WANTED - 1])
def test_the_soft_limit_is_raised_no_further_than_the_hard_one(limits: Callable[[int, int], Limits], hard: int) -> None:
    """The kernel refuses more, and all stayed at the 16 that it was."""
    set_to = limits(16, hard)
    assert raise_descriptor_limit() == ""
    assert set_to == [(hard, hard)]


def test_a_hard_limit_that_is_too_low_is_told_with_what_is_needed(limits: Callable[[int, int], Limits]) -> None:
    assert limits(16, 29) == []
    sentence = raise_descriptor_limit()
    assert sentence.startswith(
        f"A411 a process may have 29 files, ports and connections open here, {NEEDED} are needed"
    )
    assert "ulimit -n" in sentence and "LimitNOFILE=" in sentence


def test_a_limit_that_may_not_be_changed_is_told_as_it_is(
    limits: Callable[[int, int], Limits], monkeypatch: pytest.MonkeyPatch
) -> None:
    limits(20, 4096)

    def refuse(*_: Any) -> None:
        raise ValueError("not allowed to raise maximum limit")

    monkeypatch.setattr(descriptor_limit.resource, "setrlimit", refuse)
    assert "may have 20 files" in raise_descriptor_limit()


def test_a_start_tells_it_before_anything_is_started(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guardian, "raise_descriptor_limit", lambda: "A411 too few")
    monkeypatch.setattr(guardian.Guardian, "watch", lambda self: 0)
    assert guardian.run(RunOptions(state=tmp_path / "state")) == 0
    events = (tmp_path / "state" / "events.jsonl").read_text().splitlines()
    assert [json.loads(line)["code"] for line in events] == ["A411"]
