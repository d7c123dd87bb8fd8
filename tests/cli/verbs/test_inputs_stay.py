"""What a verb reads it does not write over, whatever its options say."""

from pathlib import Path

import pytest

from gateway.cli.diagnosis.outputs import check_targets, write_all
from gateway.profiles import shipped_profiles_folder
from tests.cli.verbs.calibration.test_fit import ladder_rows, written


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A ladder, a calibration and a plant, each as a file of its user's."""
    monkeypatch.chdir(tmp_path)
    written(tmp_path / "ladder.csv", ladder_rows())
    for folder, name in (("calibrations", "demo"), ("plants", "paper-slide"), ("rigs", "demo")):
        text = (shipped_profiles_folder() / folder / f"{name}.yaml").read_text(encoding="utf-8")
        (tmp_path / f"{folder}.yaml").write_text(text, encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize(
    "words",
    [
        ("fit", "ladder.csv", "--report", "ladder.csv"),
        ("fit", "ladder.csv", "--rig", "rigs.yaml", "--report", "rigs.yaml"),
        ("diagnose", "--before", "ladder.csv", "--after", "ladder.csv", "--report", "ladder.csv"),
        ("diagnose", "--before", "ladder.csv", "--after", "ladder.csv", "--json", "./ladder.csv"),
        ("diagnose", "ladder.csv", "--rig", "rigs.yaml", "--extend", "rigs.yaml"),
        ("simulate", "ladder.csv", "--rig", "rigs.yaml", "--csv", "rigs.yaml"),
        ("calibration", "compare", "calibrations.yaml", "demo", "--plot", "calibrations.yaml"),
        ("plant", "compare", "paper-slide", "plants.yaml", "--plot", "plants.yaml"),
        ("plant", "compare", "paper-slide", "plants.yaml", "--plot", "ladder.csv", "--recording", "ladder.csv"),
    ],
)
def test_no_output_takes_the_place_of_what_is_read(here: Path, call, words: tuple[str, ...]) -> None:
    before = {path: path.read_bytes() for path in here.iterdir()}
    answer = call(*words)
    assert answer.exit_code == 2 and "would be overwritten" in answer.stderr, answer.output
    assert {path: path.read_bytes() for path in here.iterdir()} == before


@pytest.mark.parametrize(
    "words",
    [
        ("diagnose", "ladder.csv", "--extend", "rigs.yaml"),
        ("diagnose", "ladder.csv", "--extend", "plants.yaml"),
        ("diagnose", "ladder.csv", "--plan", "calibrations.yaml"),
        ("diagnose", "ladder.csv", "--report", "rigs.yaml"),
        ("fit", "ladder.csv", "--report", "rigs.yaml"),
        ("simulate", "ladder.csv", "--csv", "rigs.yaml"),
    ],
)
def test_no_output_takes_the_place_of_a_profile_that_somebody_wrote(here: Path, call, words: tuple[str, ...]) -> None:
    """`--extend my-cell.yaml`, meant as "extend my cell", made a plant of the rig's file."""
    before = {path: path.read_bytes() for path in here.iterdir()}
    answer = call(*words)
    assert answer.exit_code == 1, answer.output
    assert f"E405 {words[-1]} exists and was left alone; diagnose has not written it" in answer.stderr
    assert {path: path.read_bytes() for path in here.iterdir()} == before


def test_what_diagnose_wrote_is_written_anew(tmp_path: Path) -> None:
    (tmp_path / "plan.yaml").write_text("# Written by force-gateway diagnose for what 1 could not tell\nname: plan\n")
    (tmp_path / "empty.yaml").touch()
    targets = [tmp_path / name for name in ("plan.yaml", "empty.yaml", "new.yaml")]
    check_targets(targets, [])
    write_all(dict.fromkeys(targets, "anew"))
    assert [target.read_text() for target in targets] == ["anew"] * 3


@pytest.mark.parametrize(
    "words",
    [
        ("--before", "ladder.csv", "--after", "ladder.csv", "--json", "-", "--report", "-"),
        ("ladder.csv", "--rig", "rigs.yaml", "--json", "-", "--extend", "-"),
    ],
)
def test_two_answers_do_not_share_one_stream(here: Path, call, words: tuple[str, ...]) -> None:
    """One of them was lost without a word."""
    answer = call("diagnose", *words)
    assert answer.exit_code == 2 and "- is written by another option" in answer.stderr, answer.output
    assert not answer.stdout


def test_a_calibration_whose_report_the_disk_does_not_take_is_told_as_stored(
    here: Path, call, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Who did not hear of it stored it once more."""
    from gateway.service.fitting import ladder_fit

    def refuse(target: Path, text: str) -> None:
        raise OSError(28, "No space left on device", str(target))

    monkeypatch.setattr(ladder_fit, "replace_text", refuse)
    answer = call(
        "fit", "ladder.csv", "--models", "bsfm", "--orders", "2", "--store", "--state", "state", "--rig", "demo"
    )
    assert answer.exit_code == 1 and answer.stderr.startswith("E106 "), answer.output
    assert "calibration 2 is stored, only its report is missing" in answer.stderr
    assert (here / "state" / "calibrations" / "0002.yaml").exists()
