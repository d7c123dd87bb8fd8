"""A name has one meaning: no two modules of the gateway define a class of the same name."""

import ast
from collections import defaultdict
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]


@cache
def parse_sources(folder: str) -> dict[str, ast.Module]:
    """Return the syntax trees of a folder's modules, by path from the repository."""
    files = sorted((ROOT / folder).rglob("*.py"))
    return {str(path.relative_to(ROOT)): ast.parse(path.read_text(encoding="utf-8")) for path in files}


def test_no_class_name_has_two_meanings() -> None:
    homes = defaultdict(list)
    for path, tree in parse_sources("gateway").items():
        for node in tree.body:
            if isinstance(node, ast.ClassDef):
                homes[node.name].append(path)
    assert len(homes) > 300
    assert {name: paths for name, paths in homes.items() if len(paths) > 1} == {}
