"""On a terminal of 60 or 80 columns nothing is cut: the words of every cell are there, and no line is longer."""

import io
import re
from collections.abc import Iterable

import click
import pytest
from click.testing import CliRunner
from rich.console import Console, RenderableType

from gateway.catalogue.all_effects import EFFECTS
from gateway.cli.calibration import follow
from gateway.cli.calibration.fit_table import fit_table
from gateway.cli.calibration.runs import RunStatus
from gateway.cli.diagnosis.terminal import render_diagnosis
from gateway.cli.force_hold import state_line
from gateway.cli.force_hold.sequence import StatusReading
from gateway.cli.main import VERBS, import_verb
from gateway.cli.main import command as force_gateway
from gateway.clients.wiring import TEXT_WIDTH, Section, render_page, wiring_page
from gateway.codes.warning_bits import WarningBit
from gateway.profiles import load_rig
from gateway.registers.words import State, StatusBit
from tests.reports.fake_diagnosis import diagnosis

WIDTHS = pytest.mark.parametrize("width", [60, 80])


def printed(parts: Iterable[RenderableType], width: int) -> str:
    console = Console(width=width, file=io.StringIO(), color_system=None)
    for part in parts:
        console.print(part)
    return console.file.getvalue()


def missing(text: str, words: Iterable[str], width: int) -> list[str]:
    """Return which of the words are not there, wherever they are folded, and the lines that are cut or too long."""
    flat = set(re.split(r"[\s│,]+", text))
    return [word for word in words if word not in flat] + [
        line for line in text.splitlines() if len(line) > width or "…" in line
    ]


def fitted(model: str, order: int, **more: object) -> dict[str, object]:
    return {
        "model": model,
        "order": order,
        "coefficients": 4 * order + 2,
        "rms_n": 10.123 + order,
        "max_n": 120.55 + order,
        "heldout_rms_n": 10.456 + order,
        "heldout_error_n": 10.045 + order,
        "paper_norm": 0.1234,
        "chosen": False,
        "usable": False,
        "monotone": False,
        "crossing": True,
        "steep": True,
    } | more


@WIDTHS
def test_the_table_of_fits_has_every_model_and_number(width: int) -> None:
    fits = [fitted(model, order) for model in ("pfm", "psfm", "bfm", "bsfm") for order in (1, 15)]
    fits.append(fitted("bsfm", 2, chosen=True, usable=True))
    text = printed([fit_table({"fits": fits}, width)], width)
    numbers = [f"{fit[name]:.3f}" for fit in fits for name in ("rms_n", "heldout_rms_n", "heldout_error_n")]
    numbers += [f"{fit['max_n']:.2f}" for fit in fits]
    assert (
        missing(text, [*numbers, "PFM", "PSFM", "BFM", "BSFM", "dips", "crosses", "chosen", "0.1234", "62"], width)
        == []
    )


@WIDTHS
def test_a_diagnosis_has_every_cause_and_number(width: int) -> None:
    found = diagnosis()
    text = printed(render_diagnosis(found), width)
    assert max(map(len, text.splitlines())) <= width
    assert "…" not in text
    flat = re.sub(r"\s+", "", text)
    assert all(cause.name in flat for cause in found.causes)
    assert "excess" in flat


@WIDTHS
def test_the_list_of_effects_has_every_effect_whole(width: int, call) -> None:
    text = call("effects", env={"COLUMNS": str(width)}).output
    assert max(map(len, text.splitlines())) <= width
    assert "…" not in text
    flat = re.sub(r"\s+", "", text)
    assert [effect.name for effect in EFFECTS if effect.name not in flat] == []
    words = {word for effect in EFFECTS for word in f"{effect.what} {effect.signature}".split()}
    assert [word for word in words if word not in flat] == []


@WIDTHS
def test_a_run_shows_its_phase_share_force_and_time_left(width: int, monkeypatch: pytest.MonkeyPatch) -> None:
    shown = Console(width=width, file=io.StringIO(), color_system=None, force_terminal=True)
    monkeypatch.setattr(follow, "Console", lambda stderr: shown)
    look = RunStatus("stored", 0.43, 80.0, 41.5, 4.321, ": slow ramp (12 of 15)")

    class _Run:
        def look(self) -> RunStatus:
            return look

    with follow._progress() as progress:
        follow._wait(_Run(), progress, progress.add_task("starting", total=1.0, force="", eta=""))
    text = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", shown.file.getvalue())
    for words in ("stored: slow ramp (12 of 15)", "43%", "4.32 V", "41.50 N", "1:20 left"):
        assert words in text, text


@WIDTHS
def test_the_line_of_hold_has_its_warnings(width: int) -> None:
    status = StatusReading(
        state=State.HOLDING,
        bits=StatusBit.IN_BAND | StatusBit.ENABLED,
        warnings=WarningBit.TARGET_UNREACHABLE | WarningBit.MODEL_DIFFERS,
        force_n=112.34,
        setpoint_n=112.0,
        applied_n=112.0,
        voltage_v=8.123,
    )
    line = state_line._within(state_line.describe_state(status), width - 1)
    assert missing(line, ["holding", "112.34", "112.00", "8.123", "in", "band", "A301", "A345"], width) == []


@pytest.mark.parametrize("rig", ["demo", "irc5-cell", "paper-pull"])
def test_a_wiring_page_is_folded_between_words(rig: str) -> None:
    """On 80 columns it was the terminal that broke its lines: `separate hardwa` and `re`."""
    _, sections = wiring_page(load_rig(rig), rig)
    cells = [tuple(("what", row[-1]) for row in each.rows) for each in sections]
    told = [Section(each.title, each.sentences, rows) for each, rows in zip(sections, cells, strict=True)]
    wide, narrow = (render_page("rig", told, "text", columns) for columns in (TEXT_WIDTH, 80))
    assert narrow.split() == wide.split()
    assert max(map(len, narrow.splitlines())) <= 80 < max(map(len, wide.splitlines()))


GROUPS = [verb for verb in VERBS if isinstance(import_verb(verb).command, click.Group)]


@WIDTHS
@pytest.mark.parametrize("group", ["", *GROUPS])
def test_a_list_of_verbs_says_each_sentence_to_its_end(group: str, width: int) -> None:
    """Half of the lines of `recordings --help` ended in the middle: `Delete recording N; not one that is kept, ...`."""
    told = CliRunner().invoke(force_gateway, [*group.split(), "--help"], terminal_width=width).output
    assert "Commands:" in told or "Set up a cell:" in told
    assert [line for line in told.splitlines() if line.endswith("...") and "Usage:" not in line] == []
