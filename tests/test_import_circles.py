"""No module imports another that imports it, however far round, lazy imports inside functions included."""

import ast
from pathlib import Path

import gateway

ROOT = Path(gateway.__file__).parent


def module_of(path: Path) -> str:
    return ".".join(("gateway", *path.relative_to(ROOT).with_suffix("").parts)).removesuffix(".__init__")


def imports() -> dict[str, set[str]]:
    """Module -> modules of ours that it imports, at its top or in a function."""
    sources = {module_of(path): path.read_text(encoding="utf-8") for path in ROOT.rglob("*.py")}
    found: dict[str, set[str]] = {}
    for module, source in sources.items():
        named = [
            (node.module, f"{node.module}.{each.name}")
            for node in ast.walk(ast.parse(source))
            if isinstance(node, ast.ImportFrom) and node.module
            for each in node.names
        ]
        found[module] = {full if full in sources else package for package, full in named} & set(sources) - {module}
    return found


def test_imports_go_in_no_circle() -> None:
    waiting = imports()
    assert len(waiting) > 300
    while done := {module for module, needed in waiting.items() if not needed & set(waiting)}:
        waiting = {module: needed for module, needed in waiting.items() if module not in done}
    assert sorted(waiting) == [], "these wait for each other, or for such as do"
