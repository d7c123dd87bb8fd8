"""Public functions, classes, methods and properties say what they do: a docstring, for functions one that opens with a verb."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

GATEWAY = Path(__file__).parents[2] / "gateway"
ROOMS = sorted(path.name for path in GATEWAY.iterdir() if list(path.glob("*.py")))
VERBS = frozenset(
    """Abort Accept Act Add Admit Advance Allow Announce Answer Append Apply Ask Begin Bend Build Calculate Calibrate
    Call Cancel Change Check Choose Clear Climb Close Collect Combine Come Compare Compensate Compile Compose
    Compute Continue Convert Copy Count Create Cut Decide Decode Delay Derive Descend Diagnose Draw Drop Enable
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
Definition = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef


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


def complaints_of(room: str, parent: Path = GATEWAY) -> list[str]:
    return [
        f"{path.relative_to(parent)}:{definition.lineno} {name} {words}"
        for path in sorted((parent / room).rglob("*.py"))
        for name, definition in public_definitions(ast.parse(path.read_text(encoding="utf-8")))
        if (words := complaint(definition))
    ]


@pytest.mark.parametrize("room", ROOMS)
def test_public_docstrings_open_with_a_verb(room: str) -> None:
    complaints = complaints_of(room)
    assert not complaints, "\n".join(complaints)


def test_public_docstrings_of_the_tools_open_with_a_verb() -> None:
    complaints = complaints_of("tools", GATEWAY.parent)
    assert not complaints, "\n".join(complaints)
