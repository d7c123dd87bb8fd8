"""What README and the pages beside the rooms have from the code is what the code says, and what they name is there."""

import re
import runpy
from collections.abc import Iterator
from pathlib import Path

import pytest

from gateway.cli.main import command
from gateway.clients import Endpoint, ExchangeTable
from gateway.profiles import load_register_map
from gateway.profiles.device_table import render_devices
from gateway.registers import render_block, render_most_used
from gateway.registers.roles import render_roles

ROOT = Path(__file__).parents[1]
PAGES = [
    ROOT / "README.md",
    *(page for room in ("gateway", "profiles", "tools") for page in (ROOT / room).rglob("*.md")),
]


def id_of(page: Path) -> str:
    return str(page.relative_to(ROOT))


def part(page: str, name: str) -> str:
    text = (ROOT / page).read_text(encoding="utf-8")
    return text.split(f"<!-- {name}", 1)[1].split("-->\n", 1)[1].split("<!-- end -->", 1)[0]


def test_the_tables_of_registers_are_the_map_s():
    registers = load_register_map("force-v1")
    assert part("README.md", "map") == render_most_used(registers), "run tools/readme"
    assert part("gateway/registers/README.md", "command block") == render_block(registers, "command"), (
        "run tools/readme"
    )


def test_who_writes_a_program_is_warned_of_an_enable_that_undoes_a_stop():
    """What the generated clients do about it, and what `wiring` says, is for who writes one by hand as well."""
    registers = load_register_map("force-v1")
    words = " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())
    warning = words.split("undoes another master's stop", 1)[1].split("- A rig may", 1)[0]
    behind = ExchangeTable(registers, Endpoint("127.0.0.1", 502, 1)).values_first
    assert f"from {registers.find('control_word').address + behind + 40001} on" in warning
    enabled = next(bit for bit, name in registers.find("status_word").bits.items() if name == "enabled")
    assert f"bit {enabled} of `status_word`" in warning and "setpoint 0" in warning


def test_the_table_of_devices_is_what_the_files_say():
    assert part("profiles/README.md", "devices") == render_devices(), "run tools/readme"


def test_the_table_of_roles_is_the_one_that_is_asked():
    assert part("gateway/registers/README.md", "roles") == render_roles(load_register_map("force-v1")), (
        "run tools/readme"
    )


@pytest.mark.parametrize("page", PAGES, ids=id_of)
def test_every_verb_that_a_page_names_exists(page: Path):
    named = set(re.findall(r"(?:bin/)?force-gateway ([a-z-]+)(?= |`|\n)", page.read_text(encoding="utf-8")))
    assert named <= set(command.list_commands(None)) | {"stands", "is", "s"}


@pytest.mark.parametrize("page", PAGES, ids=id_of)
def test_every_file_that_a_page_links_to_exists(page: Path):
    for target in links(page):
        path, _, heading = target.partition("#")
        linked = (page.parent / path).resolve() if path else page
        assert linked.exists(), target
        assert not heading or heading in headings(linked), target


def links(page: Path) -> Iterator[str]:
    """Yield the targets of a page's links and pictures that are no addresses of the web."""
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")):
        if not target.startswith("http"):
            yield target


def headings(page: Path) -> set[str]:
    """Return the anchors of a page's headings, as forges make them."""
    titles = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), flags=re.M)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize(
    "path",
    sorted(set(re.findall(r"(?<![-\w])(?:tools|profiles|tests|gateway)/[\w./-]*\w", (ROOT / "README.md").read_text()))),
)
def test_every_file_that_readme_names_exists(path):
    assert (ROOT / path).exists()


@pytest.mark.parametrize("places", [0, 1, 2])
def test_a_part_is_written_where_it_is_once_and_nowhere_else(tmp_path: Path, places: int) -> None:
    pages = [tmp_path / f"{number}.md" for number in range(3)]
    for number, page in enumerate(pages):
        page.write_text(f"<!-- {'map' if number < places else 'other'} -->\nold\n<!-- end -->\nbelow\n")
    replace_part = runpy.run_path(str(ROOT / "tools" / "readme"))["replace_part"]
    replace_part.__globals__["PAGES"] = pages
    if places == 1:
        replace_part("map", "new\n\n")
    else:
        with pytest.raises(SystemExit, match=f"{places} places for map"):
            replace_part("map", "new")
    assert [page.read_text().splitlines()[1] for page in pages] == ["new" if places == 1 else "old", "old", "old"]
    assert sorted(tmp_path.iterdir()) == pages
