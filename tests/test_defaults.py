"""A default stands once: what other rooms state of it is taken from gateway.defaults."""

import ast
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

import pytest

import gateway
from gateway import defaults

ROOT = Path(gateway.__file__).parent
UNMISTAKABLE = {
    name: value
    for name, value in vars(defaults).items()
    if name in ("REGISTER_MAP", "PLANT", "HOST", "MODBUS_PORT", "CELL_BAUD", "UNIT_IDS")
}
"""Values that can mean nothing else where they are written."""


@cache
def constants() -> list[tuple[str, object]]:
    """Where in the product which constant or tuple of constants is written; docstrings and examples of commands apart."""
    found: list[tuple[str, object]] = []
    for path in sorted(ROOT.rglob("*.py")):
        if path.name == "defaults.py":
            continue
        nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
        apart = {id(node.value) for node in nodes if isinstance(node, ast.Expr)} | set(_of_examples(nodes))
        for node in nodes:
            if isinstance(node, ast.Tuple) and all(isinstance(each, ast.Constant) for each in node.elts):
                value: object = tuple(each.value for each in node.elts if isinstance(each, ast.Constant))
            elif isinstance(node, ast.Constant) and id(node) not in apart:
                value = node.value
            else:
                continue
            found.append((str(path.relative_to(ROOT)), value))
    return found


def _of_examples(nodes: Iterable[ast.AST]) -> Iterator[int]:
    """What the EXAMPLES of a verb say is typed by a user, who writes values out."""
    for node in nodes:
        if isinstance(node, ast.Assign) and any(
            isinstance(each, ast.Name) and each.id == "EXAMPLES" for each in node.targets
        ):
            yield from map(id, ast.walk(node.value))


def files_with(value: object) -> set[str]:
    """Where this value is written as a constant, or inside a message: text and numbers, not tuples."""
    is_inside = (lambda text: False) if isinstance(value, tuple) else (lambda text: str(value) in text)
    return {path for path, each in constants() if each == value or (isinstance(each, str) and is_inside(each))}


ELSEWHERE = {
    "REGISTER_MAP": {"codes/errors.py"},  # advice which map to copy from
    "HOST": {
        "profiles/rigs/rig_file.py",
        "profiles/rigs/addresses.py",
        "cli/verbs/setup/certs.py",  # these three: what `localhost` means
        "codes/face_errors.py",
        "codes/errors.py",  # these two: advice to take any free port
    },
    "CELL_BAUD": {
        "codes/errors.py",
        "service/running_rig/lines/baud_probe.py",
        "service/probing/port_probe.py",
        "devices/line_settings.py",
    },  # lists of all speeds
}


@pytest.mark.parametrize("name", UNMISTAKABLE)
def test_a_default_is_written_once(name: str) -> None:
    assert files_with(UNMISTAKABLE[name]) <= ELSEWHERE.get(name, set())
