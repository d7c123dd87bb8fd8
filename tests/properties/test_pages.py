"""The pages beside the rooms: what they name is there, and what they quote is so."""

import re
from dataclasses import fields
from pathlib import Path

import pytest

from gateway.codes.all_codes import CATALOGUE
from gateway.control.settings import Supervision

ROOT = Path(__file__).parents[2]
PAGES = sorted(
    [
        *ROOT.glob("*.md"),
        *(page for room in ("gateway", "profiles", "tests", "tools") for page in (ROOT / room).rglob("*.md")),
    ]
)
HAZARDS = ROOT / "gateway" / "control" / "supervision" / "README.md"


def id_of(page: Path) -> str:
    return str(page.relative_to(ROOT))


def named_paths(text: str) -> set[str]:
    """What looks like a file or a folder in code quotes outside of blocks: `a/b.py`, `room/`."""
    prose = re.sub(r"```.*?```", "", text, flags=re.S)
    return {name for name in re.findall(r"`([\w./-]+)`", prose) if re.search(r"\.(py|md|toml)$|[a-z_]/$", name)}


def is_there(name: str, page: Path) -> bool:
    """From the repository or its package, or the end of a path below the page's folder."""
    if any((base / name).exists() for base in (page.parent, ROOT, ROOT / "gateway")):
        return True
    return page.parent != ROOT and any(page.parent.rglob(name))


@pytest.mark.parametrize("page", PAGES, ids=id_of)
def test_what_a_page_names_is_there(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    links = {link for link in re.findall(r"\]\(([^)#:]+)\)", text) if not (page.parent / link).exists()}
    assert [name for name in sorted(named_paths(text)) if not is_there(name, page)] == []
    assert links == set()


@pytest.mark.parametrize("page", [page for page in PAGES if page != ROOT / "README.md"], ids=id_of)
def test_codes_that_a_page_names_are_explained(page: Path) -> None:
    named = set(re.findall(r"\b[AEW]\d{3}\b", page.read_text(encoding="utf-8")))
    assert named <= set(CATALOGUE)


def test_the_bounds_of_the_hazards_page_are_the_defaults() -> None:
    rows = re.findall(r"^\| `(\w+)` \| ([\w.]+) \|", HAZARDS.read_text(encoding="utf-8"), flags=re.M)
    defaults = {field.name: field.default for field in fields(Supervision)}
    assert len(rows) >= 8
    assert dict(rows) == {name: str(defaults[name]).lower() for name, _ in rows}


def test_every_room_is_on_the_page_of_the_rooms() -> None:
    drawing = (ROOT / "gateway" / "README.md").read_text(encoding="utf-8").split("```")[1]
    rooms = {
        entry.stem for entry in (ROOT / "gateway").iterdir() if entry.name[0] not in "_." and entry.suffix != ".md"
    }
    assert {room for room in rooms if not re.search(rf"\b{room}\b", drawing)} == set()
