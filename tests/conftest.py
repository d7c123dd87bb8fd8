"""What every test must leave behind: no task, no descriptor, no child process."""

import asyncio
import gc
import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: the diagnosis' matrices are small


def pytest_configure() -> None:
    """A shell's background job inherits an ignored SIGINT, and so would every process under test."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--long", action="store_true", help="the same tests with a bigger budget: seeds, kills, fuzz, soak"
    )


REAL_TIME = ("end_to_end", "ports")
"""Folders whose tests start processes or wait for real lines: one worker runs them one after the other, so that their
bounds in seconds do not compete with each other."""


def pytest_itemcollected(item: pytest.Item) -> None:
    """Here and not with the whole list: the workers read the groups before a conftest may change that."""
    folder = item.path.relative_to(item.config.rootpath / "tests").parts[0]
    item.add_marker(pytest.mark.xdist_group("real time" if folder in REAL_TIME else item.path.stem))


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption("--long"):
        return
    skip = pytest.mark.skip(reason="needs the bigger budget: ./tools/test --long")
    for item in items:
        if "long" in item.keywords:
            item.add_marker(skip)


@pytest.fixture
def budget(request: pytest.FixtureRequest) -> int:
    """How many times more than in the push gate a test may run its loop: 1, or 20 with --long."""
    return 20 if request.config.getoption("--long") else 1


def open_descriptors() -> dict[str, str]:
    found = {}
    for entry in Path("/proc/self/fd").iterdir():
        try:
            found[entry.name] = str(entry.readlink())
        except OSError:  # the listing's own descriptor
            continue
    return {name: target for name, target in found.items() if not target.startswith("/proc/")}


@pytest.fixture(autouse=True)
def nothing_leaks(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """asyncio.run cancels left-over tasks silently; here they fail the test, and so do left-over descriptors."""
    left_over: list[str] = []
    cancel_all_tasks = asyncio.runners._cancel_all_tasks  # type: ignore[attr-defined]

    def cancel_and_tell(loop: asyncio.AbstractEventLoop) -> None:
        left_over.extend(repr(task) for task in asyncio.all_tasks(loop))
        cancel_all_tasks(loop)

    monkeypatch.setattr(asyncio.runners, "_cancel_all_tasks", cancel_and_tell)
    before = open_descriptors()
    yield
    assert not left_over, f"tasks left behind: {left_over}"
    after = open_descriptors()
    if len(after) > len(before):
        gc.collect()
        after = open_descriptors()
    leaked = {name: target for name, target in after.items() if before.get(name) != target}
    assert len(after) <= len(before), f"descriptors left behind: {leaked}"
