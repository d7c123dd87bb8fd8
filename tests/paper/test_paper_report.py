"""The command as a whole: few seeds in the push gate, all of them in the long run."""

import re
import subprocess
import sys
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from types import ModuleType

import pytest
from paper.verdicts.tracking import judge_roughness

COMMAND = Path(__file__).parents[2] / "tools" / "paper" / "reproduce"


def reproduce() -> ModuleType:
    loader = SourceFileLoader("paper_reproduce", str(COMMAND))
    spec = spec_from_loader(loader.name, loader)
    assert spec is not None
    module = module_from_spec(spec)
    loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def figures() -> set[str]:
    """matplotlib is imported by the worker that runs this file, not by all."""
    from paper.figures.all_figures import FIGURES

    return set(FIGURES)


def pictures_in(page: str) -> set[str]:
    figure = r'<figure id="([a-z0-9-]+)" class="full"><div class="picture" tabindex="0"><img alt="[^"]+" src="data:image/png;'
    return set(re.findall(figure + "base64,", page))


def test_figure_10_is_outside_software_whatever_the_numbers() -> None:
    assert judge_roughness().where == "Fig. 10"
    assert judge_roughness().verdict == "outside software"


SMALL = """
import runpy, sys
sys.path.insert(0, sys.argv[1])
from paper.experiments import exercises
exercises.PACE_N_PER_S, exercises.QUICK_RECIPROCATING_S, exercises.FIRST_S = 10.0, 6.0, 1.0
exercises.STEP_S, exercises.UNLOADED_S, exercises.QUICK_HOLDS, exercises.TRAVEL_M = 1.2, 0.4, 3, 0.005
sys.exit(runpy.run_path(sys.argv[1] + "/paper/reproduce", run_name="small")["main"](sys.argv[2:]))
"""


@pytest.mark.long
def test_the_report_is_one_file_with_every_figure_and_the_terminal_shows_the_same_verdicts(
    tmp_path: Path, figures: set[str]
) -> None:
    """In a process of its own, where a warning is an error: matplotlib keeps its fonts open for ever."""
    page_file, folder = tmp_path / "report.html", tmp_path / "figures"
    words = [str(COMMAND.parents[1]), "--quick", "--seeds", "2", "--output", str(page_file), "--figures", str(folder)]
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", SMALL, *words], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    page = page_file.read_text(encoding="utf-8")
    assert pictures_in(page) == figures == {path.stem for path in folder.iterdir()}
    assert not re.search(r'(src|href)="(?!data:)', page)
    for word in ("reproduced", "not reproduced", "outside software"):
        assert f">{word}</td>" in page
        assert word in done.stdout
    for place in ("Fig. 4", "Fig. 5", "Fig. 6", "Fig. 7", "Fig. 8", "Fig. 9", "Fig. 10"):
        assert place in page
    assert not re.search(r"\bnan\b", re.sub(r"base64,[^\"]+", "", page))
    assert re.search(
        r"<h1>\d+ of 25 statements of the paper are reproduced on the twin, \d+ are not, 1 lies outside software</h1>",
        page,
    )
    assert "prefers-color-scheme" in page and "<footer>" in page


@pytest.mark.parametrize("words", [["--seeds", "1"], ["--output", "/no/such/directory/report.html"]])
def test_a_wish_that_cannot_be_met_is_refused_before_anything_runs(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as refused:
        reproduce().main(words)
    assert refused.value.code == 2
    assert words[0] in capsys.readouterr().err


@pytest.mark.long
def test_the_whole_study_says_what_the_readme_may_claim(tmp_path: Path, figures: set[str]) -> None:
    page_file = tmp_path / "report.html"
    done = subprocess.run(
        [sys.executable, str(COMMAND), "--output", str(page_file)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "14 reproduced, 10 not reproduced, 1 outside software" in done.stdout
    assert "Goal at most 0.7 of the settling time: the gateway's controller meets it in 4 of 4" in done.stdout
    assert pictures_in(page_file.read_text(encoding="utf-8")) == figures
