"""A default stands once: what other rooms state of it is taken from gateway.defaults."""

import ast
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


def places_of(value: object) -> list[str]:
    """Where in the product this value is written as a constant (or inside a message, for text and the port)."""
    found = []
    for path in sorted(ROOT.rglob("*.py")):
        if path.name == "defaults.py":
            continue
        tree = ast.parse(path.read_text(encoding="utf-8"))
        docstrings = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
        for node in ast.walk(tree):
            if isinstance(node, ast.Tuple) and all(isinstance(each, ast.Constant) for each in node.elts):
                same = tuple(each.value for each in node.elts if isinstance(each, ast.Constant)) == value
            elif isinstance(node, ast.Constant) and id(node) not in docstrings:
                is_text = isinstance(node.value, str) and not isinstance(value, tuple)
                same = node.value == value or (is_text and str(value) in str(node.value))
            else:
                continue
            if same:
                found.append(f"{path.relative_to(ROOT)}:{node.lineno}")
    return found


ELSEWHERE = {
    "HOST": {"profiles/rigs/rig_file.py", "codes/errors.py"},  # what `localhost` means; advice to take any free port
    "CELL_BAUD": {
        "codes/errors.py",
        "service/running_rig/lines/baud_probe.py",
        "devices/line_settings.py",
    },  # lists of all speeds
}


@pytest.mark.parametrize("name", UNMISTAKABLE)
def test_a_default_is_written_once(name: str) -> None:
    places = {place.rpartition(":")[0] for place in places_of(UNMISTAKABLE[name])}
    assert places <= ELSEWHERE.get(name, set())
