"""How the gate shares its tests among workers: what must stay together does, and no name in the lists is out of date. What
workers tell of a test, and that none leaves anything behind."""

import asyncio
import fcntl
import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from tests.conftest import LONG_WAITS, REAL_TIME, SLOW, SPREAD, begun_at, find_leaks, group_of, leave_out_long
from tests.workers import FewMessages, OneCompiler, schedule_groups

TESTS = Path(__file__).parent


def test_a_file_is_one_group_whatever_its_parameters_are_called() -> None:
    file = "tests/twin/test_any.py"
    assert {group_of(f"{file}::{name}") for name in ("test_a", "test_b[a::b]", "test_c[x@y]")} == {"twin/test_any.py"}


def test_all_that_is_in_real_time_is_one_group_and_begins_first() -> None:
    nodeids = [f"tests/{folder}/test_any.py::test_a" for folder in REAL_TIME]
    assert {group_of(nodeid) for nodeid in nodeids} == {"real time"}
    assert {begun_at(nodeid) for nodeid in nodeids} == {0}


def test_what_waits_for_minutes_is_the_second_group() -> None:
    nodeids = [f"tests/{file}::test_a" for file in LONG_WAITS]
    assert {(group_of(nodeid), begun_at(nodeid)) for nodeid in nodeids} == {("long waits", 1)}


def test_each_recording_of_the_sample_is_a_group_and_the_laws_over_them_are_one() -> None:
    for prefix in SPREAD:
        assert len({group_of(f"tests/{prefix}{number}]") for number in range(19)}) == 19
    file = SPREAD[0].partition("::")[0]
    assert group_of(f"tests/{file}::test_nothing_is_found_in_nothing") == file


def test_slow_files_begin_before_others() -> None:
    ranks = [begun_at(f"tests/{file}::test_a") for file in (*SLOW, "twin/test_any.py")]
    assert ranks == sorted(set(ranks))
    assert all(begun_at(f"tests/{prefix}3]") < ranks[0] for prefix in SPREAD)


def test_every_place_that_the_lists_name_is_there() -> None:
    assert all((TESTS / place).exists() for place in (*REAL_TIME, *LONG_WAITS, *SLOW))
    for prefix in SPREAD:
        file, _, name = prefix.partition("::")
        assert f"def {name.removesuffix('[')}(" in (TESTS / file).read_text(encoding="utf-8")


class WorkerInteractor:
    """Stands for xdist's."""

    def __init__(self) -> None:
        self.told: list[tuple[str, Any]] = []

    def sendevent(self, name: str, **contents: Any) -> None:
        self.told.append((name, contents))


def report(when: str, outcome: str, duration_s: float = 0.0, said: tuple[tuple[str, str], ...] = ()) -> Any:
    place = ("a.py", 1, "test_a")
    return pytest.TestReport("a.py::test_a", place, {}, outcome, None, when, user_properties=said, duration=duration_s)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("one", "is_told"),
    [
        (report("call", "passed"), True),
        (report("setup", "passed"), False),
        (report("teardown", "passed"), False),
        (report("setup", "failed"), True),
        (report("setup", "skipped"), True),
        (report("teardown", "failed"), True),
        (report("setup", "passed", 0.2), True),
        (report("teardown", "passed", said=(("tried again", "stolen"),)), True),
    ],
)
def test_the_master_is_told_of_all_but_a_fixture_that_went_well(one: Any, is_told: bool) -> None:
    plugins, worker = pytest.PytestPluginManager(), WorkerInteractor()
    plugins.register(worker)
    few = FewMessages(plugins)
    data = few.pytest_report_to_serializable(one) or {"outcome": one.outcome}
    worker.sendevent("testreport", data=data | {"item_index": 3})
    worker.sendevent("logstart", nodeid=one.nodeid)
    worker.sendevent("runtest_protocol_complete", item_index=3)
    told = [("testreport", {"data": {"outcome": one.outcome, "item_index": 3}})] if is_told else []
    assert worker.told == [*told, ("runtest_protocol_complete", {"item_index": 3})]


def test_a_group_is_handed_on_by_the_places_of_its_tests() -> None:
    class Node:
        shutting_down = False

        def __init__(self) -> None:
            self.given: list[int] = []

        def send_runtest_some(self, places: list[int]) -> None:
            self.given += places

    node: Any = Node()
    config: Any = SimpleNamespace(getvalue=lambda name: ["popen"], option=SimpleNamespace())
    shared = schedule_groups(lambda nodeid: nodeid[0], config, None)
    shared.add_node(node)
    shared.registered_collections[node] = ["a1", "b1", "a2", "b2", "a3"]
    shared.workqueue.update({"b": {"b1": True, "b2": False}, "a": {"a1": False, "a2": False, "a3": False}})
    shared._assign_work_unit(node)
    assert node.given == [3]
    shared._assign_work_unit(node)
    assert node.given == [3, 0, 2, 4] and not shared.workqueue
    shared.assigned_work[node]["b"]["b2"] = True
    shared.workqueue["c"] = {"b1": False}
    shared._assign_work_unit(node)
    assert list(shared.assigned_work[node]) == ["a", "c"], "what is done is counted no more"


def test_a_descriptor_that_is_left_fails_its_test_and_one_that_is_closed_does_not() -> None:
    check = find_leaks()
    next(check)
    number = os.open("/dev/null", os.O_RDONLY)
    with pytest.raises(AssertionError, match=r"descriptors left behind: .*/dev/null"):
        next(check)
    os.close(number)
    assert list(find_leaks()) == [None]


def test_a_task_that_is_left_fails_its_test() -> None:
    async def leave_one() -> None:
        asyncio.get_running_loop().create_task(asyncio.sleep(60.0), name="left")

    check = find_leaks()
    next(check)
    asyncio.run(leave_one())
    with pytest.raises(AssertionError, match=r"tasks left behind: .*left"):
        next(check)
    assert list(find_leaks()) == [None]


def test_one_worker_compiles_at_a_time_and_a_loop_within_another_waits_for_nobody(tmp_path: Path) -> None:
    lock, held = tmp_path / "lock", list[bool]()
    lock.touch()

    def is_free() -> bool:
        with lock.open("rb") as other:
            try:
                fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                return False
            return True

    class Dispatcher:
        def __init__(self, *calls: Any) -> None:
            self.calls = calls

        def compile(self, types: object) -> object:
            held.append(not is_free())
            for loop in self.calls:
                loop.compile(types)
            held.append(not is_free())
            return types

    OneCompiler(lock).take_turns(Dispatcher)
    assert Dispatcher(Dispatcher(), Dispatcher()).compile("floats") == "floats"
    assert held == [True] * 6 and is_free()


@pytest.mark.parametrize(("in_silence", "left"), [(False, ["short", "long"]), (True, ["short"])])
def test_what_needs_the_bigger_budget_does_not_run_without_it(in_silence: bool, left: list[str]) -> None:
    class Item:
        def __init__(self, name: str, *keywords: str) -> None:
            self.name, self.keywords, self.marks = name, keywords, list[str]()

        def add_marker(self, mark: pytest.MarkDecorator) -> None:
            self.marks.append(mark.name)

    items: list[Any] = [Item("short"), Item("long", "long")]
    short, long = items
    leave_out_long(items, in_silence=in_silence)
    assert [item.name for item in items] == left
    assert (short.marks, long.marks) == ([], ["skip"])
