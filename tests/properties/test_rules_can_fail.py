"""Each rule over the sources fails by a violation that is planted in a made tree, and by none in the tree without one."""

import ast
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.properties import test_codes_decide, test_pages, test_source_style
from tests.properties.test_every_test_asserts import asserts
from tests.properties.test_source_style import complaint

ROOMS, FILES = 52, 14
"""As many as the rules want to see, lest they look at nothing."""
WELL = '''class C{0}:
    """It."""


def open_{0}(a: int) -> None:
    """Open it."""


def close_{0}(a: int) -> None:
    """Close it."""


def take_{0}(a: int) -> None:
    """Take it."""
'''


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("made")
    (root / "tests").mkdir()
    for number in range(ROOMS * FILES):
        room = root / "gateway" / f"room{number // FILES}"
        room.mkdir(parents=True, exist_ok=True)
        (room / f"m{number}.py").write_text(WELL.format(number))
    return root


@pytest.fixture
def planted(tree: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str, str], None]]:
    """Write files into the tree whose sources the rules look at; they are gone behind the test."""
    monkeypatch.setattr(test_source_style, "ROOT", tree)
    files: list[Path] = []

    def plant(name: str, text: str) -> None:
        files.append(tree / name)
        files[-1].write_text(text)

    def forget() -> None:
        test_source_style.nodes_of.cache_clear()
        test_source_style.parse_sources.cache_clear()

    forget()
    yield plant
    forget()
    for file in files:
        file.unlink()


LONG = "def open_it() -> None:\n" + '    """Open it."""\n' * 40
Plants = list[tuple[str, str]]
RULES: list[tuple[Callable[[], None], Plants]] = [
    (test_source_style.test_no_class_name_has_two_meanings, [("gateway/room0/x.py", "class C700:\n    pass\n")]),
    (test_source_style.test_no_function_is_too_long, [("gateway/room0/x.py", LONG)]),
    (test_source_style.test_no_function_has_too_many_parameters, [
        ("gateway/room0/x.py", "class X:\n    def f(self, a, b, /, c, *, d, e, f): ...\n")]),
    (test_source_style.test_no_file_is_too_long_and_no_room_too_full, [("gateway/room0/x.py", "\n" * 331)]),
    (test_source_style.test_no_file_is_too_long_and_no_room_too_full, [
        ("gateway/room0/x.py", ""), ("gateway/room0/y.py", "")]),
    (test_source_style.test_no_file_is_too_long_and_no_room_too_full, [(f"tests/x{each}.py", "") for each in range(16)]),
    (test_source_style.test_no_test_file_is_too_long, [("tests/test_x.py", "\n" * 301)]),
    (test_source_style.test_nobody_asks_pathlib_what_is_there, [("gateway/room0/x.py", "is_so = path.is_dir()\n")]),
    (test_source_style.test_imports_go_in_no_circle, [
        ("gateway/room0/x.py", "from gateway.room1.y import a\n"),
        ("gateway/room1/y.py", "def f() -> None:\n    from gateway.room0 import x\n")]),
]  # fmt: skip


@pytest.mark.parametrize("number", range(len(RULES)))
def test_each_rule_of_the_sources_sees_what_is_planted(number: int, planted: Callable[[str, str], None]) -> None:
    rule, plants = RULES[number]
    rule()
    test_source_style.nodes_of.cache_clear()
    test_source_style.parse_sources.cache_clear()
    for name, text in plants:
        planted(name, text)
    with pytest.raises(AssertionError):
        rule()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("def f(): ...", "has no docstring"),
        ("class F: ...", "has no docstring"),
        ("def f():\n    'The force.'", "no verb"),
        ("async def f():\n    'The force.'", "no verb"),
        ("@property\ndef f(self):\n    'Whether it is.'", "not with a noun"),
        ("@property\ndef f(self):\n    'The force.'", ""),
        ("@f.setter\ndef f(self, a): ...", ""),
        ("def f():\n    'Open, if it may.'", ""),
    ],
)
def test_the_rule_of_docstrings_sees_what_is_wrong(text: str, says: str) -> None:
    ((_, definition),) = test_source_style.public_definitions(ast.parse(text))
    assert says in complaint(definition)
    assert bool(says) is bool(complaint(definition))


@pytest.mark.parametrize(
    ("text", "is_so"),
    [("f()", False), ("x = 1", False), ("f.failed()", True), ("assert f()", True), ("expect_it()", True)],
)
def test_a_test_that_asserts_nothing_is_seen(text: str, is_so: bool) -> None:
    assert asserts(ast.parse(text)) is is_so


DECIDES = [mark.args[1] for mark in test_codes_decide.test_nothing_is_decided_by_english.pytestmark]  # type: ignore[attr-defined]
ENGLISH = ['f"info {code}"', 'if "not open" in message:', "if reason.startswith(word):", "if word in str(error):"]


@pytest.mark.parametrize(("decides", "line"), list(zip(DECIDES[0], ENGLISH, strict=True)))
def test_each_way_to_decide_by_english_is_seen(
    decides: str, line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (file := tmp_path / "x.py").write_text("if code is Code.A:\n    x = 1\n")
    monkeypatch.setattr(test_codes_decide, "SOURCES", [file])
    test_codes_decide.test_nothing_is_decided_by_english(decides)
    file.write_text(f"{line}\n")
    with pytest.raises(AssertionError):
        test_codes_decide.test_nothing_is_decided_by_english(decides)


@pytest.mark.parametrize(
    ("rule", "text"),
    [
        (test_pages.test_what_a_page_names_is_there, "See `gateway/nowhere.py`."),
        (test_pages.test_what_a_page_names_is_there, "See `no_room/`."),
        (test_pages.test_what_a_page_names_is_there, "See [it](nowhere.md)."),
        (test_pages.test_codes_that_a_page_names_are_explained, "It tells A999."),
    ],
)
def test_a_page_that_names_what_is_not_there_is_seen(rule: Callable[[Path], None], text: str, tmp_path: Path) -> None:
    (page := tmp_path / "page.md").write_text("See `page.md` and [it](page.md).")
    rule(page)
    page.write_text(text)
    with pytest.raises(AssertionError):
        rule(page)
