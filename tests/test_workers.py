"""How the gate shares its tests among workers: what must stay together does, and no name in the lists is out of date."""

from pathlib import Path

from tests.conftest import LONG_WAITS, REAL_TIME, SLOW, SPREAD, begun_at, group_of

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
