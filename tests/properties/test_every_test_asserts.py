"""Every test says what has to be so: an `assert`, an exception that it expects, or a helper that is named for asserting."""

import ast
from pathlib import Path

TESTS = Path(__file__).parents[1]
EXPECTING = ("raises", "warns")
ASSERTING = ("assert_", "expect_", "fail")


def called_names(node: ast.AST) -> set[str]:
    """Return the last part of the name of everything that is called."""
    called = [each.func for each in ast.walk(node) if isinstance(each, ast.Call)]
    attributes = {each.attr for each in called if isinstance(each, ast.Attribute)}
    return attributes | {each.id for each in called if isinstance(each, ast.Name)}


def asserts(test: ast.AST) -> bool:
    """Return whether a test can fail by what it says, and not by an accident only."""
    if any(isinstance(node, ast.Assert) for node in ast.walk(test)):
        return True
    return any(name in EXPECTING or name.startswith(ASSERTING) for name in called_names(test))


def test_every_test_asserts_something() -> None:
    found = [
        (f"{path.relative_to(TESTS)}:{node.lineno} {node.name}", asserts(node))
        for path in sorted(TESTS.rglob("test_*.py"))
        for node in ast.parse(path.read_text(encoding="utf-8")).body
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.name.startswith("test_")
    ]
    assert len(found) > 1000
    assert [name for name, is_asserting in found if not is_asserting] == []
