"""The sample of mutants: drawn by its seed, without those that change words for people, and honest about what nobody saw."""

import json
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from types import ModuleType

import pytest

FILE = Path(__file__).parents[2] / "tools" / "mutation" / "sample.py"
NAMES = [f"gateway.room.x_{number}__mutmut_1" for number in range(40)]


def load() -> ModuleType:
    loader = SourceFileLoader("mutation_sample", str(FILE))
    specification = spec_from_loader("mutation_sample", loader)
    assert specification
    module = module_from_spec(specification)
    loader.exec_module(module)
    return module


SAMPLE = load()


@pytest.fixture
def tree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A mutated tree of 40 mutants, every fourth of which changes nothing but words."""
    folder = tmp_path / "mutants" / "gateway"
    folder.mkdir(parents=True)
    codes = {name: 1 if number % 2 else 33 for number, name in enumerate(NAMES)}
    (folder / "room.py.meta").write_text(json.dumps({"exit_code_by_key": codes}), encoding="utf-8")

    def describe(name: str, file: str) -> object:
        return SAMPLE.Mutant(name, file, "", NAMES.index(name) % 4 == 0)

    monkeypatch.setattr(SAMPLE, "describe", describe)
    return tmp_path


def drawn(tree: Path, count: int, seed: int, *, wording: bool = False) -> list[str]:
    return [one.name for one in SAMPLE.draw(tree, count, seed, wording=wording)]


def test_a_seed_draws_the_same_mutants_again_and_another_one_others(tree: Path) -> None:
    assert drawn(tree, 10, 7) == drawn(tree, 10, 7)
    assert set(drawn(tree, 10, 7)) != set(drawn(tree, 10, 8))
    assert drawn(tree, 5, 7) == drawn(tree, 10, 7)[:5], "a larger sample holds the smaller one"


def test_changes_of_words_alone_are_drawn_only_where_they_are_asked_for(tree: Path) -> None:
    assert len(drawn(tree, 1000, 1)) == 30
    assert sorted(drawn(tree, 1000, 1, wording=True)) == sorted(NAMES)


@pytest.mark.parametrize(
    ("before", "after", "is_same"),
    [
        ('raise Refused("too large")', 'raise Refused("XXtoo largeXX")', True),
        ('raise Refused("too large")', "raise Refused(None)", False),
        ("return a + b", "return a - b", False),
        ("x = 1  # a comment", "x = 1", False),
        ('pack(">H", word)', 'pack("XX>HXX", word)', True),
    ],
)
def test_what_stands_in_quotes_is_told_apart_from_code(before: str, after: str, is_same: bool) -> None:
    assert (SAMPLE._without_text(before) == SAMPLE._without_text(after)) == is_same


def test_a_mutant_that_no_test_calls_is_not_counted_as_seen(tree: Path) -> None:
    results = SAMPLE.read_results(tree)
    assert {code for code in results.values() if code not in (*SAMPLE.KILLED, *SAMPLE.TIMED_OUT)} == {SAMPLE.UNASKED}
    assert 0 not in SAMPLE.KILLED + SAMPLE.TIMED_OUT, "whose tests all pass"
