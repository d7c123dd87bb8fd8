"""The source reads well: names have one meaning, docstrings say what a thing does, nothing is too long, no import goes round.

Public functions, classes, methods and properties have a docstring, for functions one that opens with a verb.

Beyond these bounds something wants to be two things; files should have 300 lines at most.
"""

import ast
import gc
import re
from collections import Counter, defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ROOMS = sorted(path.name for path in (ROOT / "gateway").iterdir() if list(path.glob("*.py")))
LONGEST_FUNCTION = 40  # lines
LONGEST_FILE = 330  # lines, but for the one table of all refusals
LONGEST_TEST_FILE = 300
MOST_PARAMETERS = 5
MOST_FILES = 15  # of a room, and of a folder of tests
TABLES = frozenset(["gateway/codes/refusals.py"])
Function = ast.FunctionDef | ast.AsyncFunctionDef
Definition = Function | ast.ClassDef
VERBS = frozenset(
    """Abort Accept Act Add Admit Advance Allow Announce Answer Append Apply Ask Begin Bend Build Calculate Calibrate
    Call Cancel Change Check Choose Clear Climb Close Collect Combine Come Compare Compensate Compile Compose
    Compute Continue Convert Copy Count Create Cut Decide Decode Delay Delete Derive Descend Diagnose Draw Drop Enable
    Encode End Ensure Estimate Evaluate Exclude Execute Expect Explain Export Extend Fade Fetch Fill Find Finish Fit
    Fold Follow Forget Fork Format Give Go Greet Group Guard Hand Handle Have Hold Import Include Index Insert
    Install Interpolate Join Judge Keep Kill Label Latch Learn Leave Lend Let Limit List Listen Load Log Look Make
    Map Mark Match Measure Merge Model Move Name Note Offer Open Order Pack Parse Pass Pick Plan Play Plot Poll
    Prepare Print Propose Provide Publish Pull Put Queue Raise Ramp Rank Read Reap Receive Record Refine Refit
    Refresh Refuse Reject Release Remember Remove Render Replace Replay Report Request Require Resample Reset
    Restart Restore Return Roll Round Run Save Say Scale Search Select Send Serve Set Shift Show Simulate Sleep
    Slide Smooth Solve Sort Split Start Step Stop Store Sum Swap Switch Take Tell Test Time Track Translate Try Turn
    Undo Unite Unpack Update Upload Use Verify Wait Walk Watch Weigh Withdraw Work Write Yield""".split()
)
NO_NOUN = frozenset("As For How If It None Of On Told What When Where Whether Who Why".split())


@cache
def parse_sources(folder: str) -> dict[str, ast.Module]:
    """Return the syntax trees of a folder's modules, by path from the repository. Of half a million nodes none is garbage: to
    look for some meanwhile takes longer than to parse."""
    files = sorted((ROOT / folder).rglob("*.py"))
    gc.disable()
    try:
        return {str(path.relative_to(ROOT)): ast.parse(path.read_text(encoding="utf-8")) for path in files}
    finally:
        gc.enable()


@pytest.fixture(scope="module", autouse=True)
def forget_the_sources() -> Iterator[None]:
    """The worker goes on with other tests: of a million nodes more, each of their collections of garbage takes a second."""
    yield
    nodes_of.cache_clear()
    parse_sources.cache_clear()


@cache
def nodes_of(path: str) -> tuple[ast.FunctionDef | ast.AsyncFunctionDef | ast.ImportFrom, ...]:
    """Return a module's functions and imports, inner ones too."""
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ImportFrom)
    return tuple(node for node in ast.walk(parse_sources("gateway")[path]) if isinstance(node, kinds))


def test_no_class_name_has_two_meanings() -> None:
    homes = defaultdict(list)
    for path, tree in parse_sources("gateway").items():
        for node in tree.body:
            if isinstance(node, ast.ClassDef):
                homes[node.name].append(path)
    assert len(homes) > 300
    assert {name: paths for name, paths in homes.items() if len(paths) > 1} == {}


def functions() -> Iterator[tuple[str, Function]]:
    for path in parse_sources("gateway"):
        yield from ((path, node) for node in nodes_of(path) if isinstance(node, Function))


def parameters_of(function: Function) -> int:
    given = function.args
    names = [each.arg for each in (*given.posonlyargs, *given.args, *given.kwonlyargs)]
    return len(names) - (names[:1] in (["self"], ["cls"]))


def test_no_function_is_too_long() -> None:
    lines = {f"{path} {node.name}": (node.end_lineno or 0) - node.lineno + 1 for path, node in functions()}
    assert len(lines) > 2000
    assert {name: count for name, count in lines.items() if count > LONGEST_FUNCTION} == {}


def test_no_function_has_too_many_parameters() -> None:
    counts = {f"{path} {node.name}": parameters_of(node) for path, node in functions()}
    assert {name: count for name, count in counts.items() if count > MOST_PARAMETERS} == {}


def test_no_file_is_too_long_and_no_room_too_full() -> None:
    lines = {path: (ROOT / path).read_text(encoding="utf-8").count("\n") for path in parse_sources("gateway")}
    tests = [str(path.relative_to(ROOT)) for path in (ROOT / "tests").rglob("*.py")]
    files = [path for path in (*lines, *tests) if not path.endswith("__init__.py")]
    rooms = Counter(str(Path(path).parent) for path in files)
    assert {path: count for path, count in lines.items() if count > LONGEST_FILE and path not in TABLES} == {}
    assert {room: count for room, count in rooms.items() if count > MOST_FILES} == {}


def test_no_test_file_is_too_long() -> None:
    """Simulated machines and languages of clients, which tests have beside them, may be longer."""
    found = {str(path.relative_to(ROOT)): path for path in (ROOT / "tests").rglob("test_*.py")}
    lines = {name: path.read_text(encoding="utf-8").count("\n") for name, path in found.items()}
    assert {name: count for name, count in lines.items() if count > LONGEST_TEST_FILE} == {}


def test_nobody_asks_pathlib_what_is_there() -> None:
    """It says no where a disk does not tell, from Python 3.14 on: `gateway.plain_file` raises."""
    asked = re.compile(r"\.(exists|is_dir|is_file)\(\)")
    texts = {path: (ROOT / path).read_text(encoding="utf-8") for path in parse_sources("gateway")}
    assert len(texts) > 700
    assert [path for path, text in texts.items() if asked.search(text)] == []


def public_definitions(node: ast.Module | ast.ClassDef, prefix: str = "") -> Iterator[tuple[str, Definition]]:
    for child in node.body:
        if isinstance(child, Definition) and not child.name.startswith("_"):
            yield prefix + child.name, child
            if isinstance(child, ast.ClassDef):
                yield from public_definitions(child, f"{prefix}{child.name}.")


def complaint(definition: Definition) -> str:
    """Return what is wrong with a definition's docstring; empty where nothing is."""
    decorators = (
        [] if isinstance(definition, ast.ClassDef) else [ast.unparse(each) for each in definition.decorator_list]
    )
    if any(name == "overload" or name.endswith(".setter") for name in decorators):
        return ""  # the docstring stands at the function itself, or the property's getter
    text = ast.get_docstring(definition)
    if not text:
        return "has no docstring"
    word = text.split()[0].rstrip(",;:.")
    if any("property" in name for name in decorators):
        return f"opens with {word!r}, not with a noun or a verb" if word in NO_NOUN else ""
    if not isinstance(definition, ast.ClassDef) and word not in VERBS:
        return f"opens with {word!r}, which is no verb that is known here"
    return ""


def complaints_of(folder: str) -> list[str]:
    return [
        f"{path}:{definition.lineno} {name} {words}"
        for path, tree in parse_sources(folder.split("/")[0]).items()
        if path.startswith(f"{folder}/")
        for name, definition in public_definitions(tree)
        if (words := complaint(definition))
    ]


@pytest.mark.sampled
@pytest.mark.parametrize("folder", [*(f"gateway/{room}" for room in ROOMS), "tools"])
def test_public_docstrings_open_with_a_verb(folder: str) -> None:
    complaints = complaints_of(folder)
    assert not complaints, "\n".join(complaints)


def module_of(path: str) -> str:
    return path.removesuffix(".py").replace("/", ".").removesuffix(".__init__")


def imports() -> dict[str, set[str]]:
    """Module -> modules of ours that it imports, at its top or in a function."""
    paths = {module_of(path): path for path in parse_sources("gateway")}
    found: dict[str, set[str]] = {}
    for module, path in paths.items():
        named = [
            (node.module, f"{node.module}.{each.name}")
            for node in nodes_of(path)
            if isinstance(node, ast.ImportFrom) and node.module
            for each in node.names
        ]
        found[module] = {full if full in paths else package for package, full in named} & set(paths) - {module}
    return found


def test_imports_go_in_no_circle() -> None:
    """No module imports another that imports it, however far round, lazy imports inside functions included."""
    waiting = imports()
    assert len(waiting) > 300
    while done := {module for module, needed in waiting.items() if not needed & set(waiting)}:
        waiting = {module: needed for module, needed in waiting.items() if module not in done}
    assert sorted(waiting) == [], "these wait for each other, or for such as do"
