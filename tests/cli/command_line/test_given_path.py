"""A path is the one that its user means: `~` also where no shell says so, and nothing is no path."""

import os
from pathlib import Path

import click
import pytest

from gateway.cli.command_line.given_path import refuse_senseless_words
from gateway.profiles import ProfileError, load_rig
from gateway.profiles.rigs.faces import TlsFace

WRITES = (
    ("run", "demo", "--sim", "--bind", "127.0.0.1:0", "--state", ""),
    ("run", "", "--sim"),
    ("backup", ""),
    ("backup", "b.tar.gz", "--state", ""),
    ("events", "--state", ""),
    ("report", ""),
    ("certs", ""),
    ("ports", ""),
    ("fit", ""),
    ("diagnose", "--json", "-", ""),
    ("recordings", "list", "--rig", ""),
    ("recordings", "list", "--rig="),
    ("read", "state", "--gateway", ""),
)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path


@pytest.mark.parametrize("words", WRITES, ids=" ".join)
def test_an_empty_name_is_refused_and_is_not_the_folder_that_one_stands_in(
    words: tuple[str, ...], here: Path, call
) -> None:
    """`run demo --sim --state "$CELL"`, CELL not set, kept the rig's state among what lay there."""
    answer = call(*words)
    assert answer.exit_code == 2, answer.output
    assert "an empty name: is a variable of the shell not set?" in answer.stderr
    assert [path.name for path in here.iterdir()] == ["here"] and not list(Path().iterdir())


def test_a_tilde_that_no_shell_has_replaced_is_the_home_directory(here: Path, call) -> None:
    """bash leaves it in `--state=~/cell`, and a folder called ~ was made."""
    (here / "home" / "cell" / "recordings").mkdir(parents=True)
    answer = call("backup", "~/cell.tar.gz", "--state=~/cell")
    assert answer.exit_code == 0, answer.output
    assert (here / "home" / "cell.tar.gz").is_file() and not list(Path().iterdir())


def test_words_for_people_may_be_empty() -> None:
    refuse_senseless_words(["record", "on", "--name", "", "--note="])
    with pytest.raises(click.UsageError, match="--state: an empty name"):
        refuse_senseless_words(["record", "on", "--name", "", "--state="])


@pytest.mark.parametrize(
    "words",
    [("read",), ("registers",), ("calibration", "show"), ("hold",), ("read", "--unit"), ("write", "force_setpoint=12")],
    ids=" ".join,
)
def test_a_word_of_more_characters_than_any_name_or_number_has_is_told_as_such(words: tuple[str, ...], call) -> None:
    """As a register's number, or a calibration's, it was an internal error."""
    answer = call(*words, 5000 * "9")
    assert answer.exit_code == 2, answer.output
    assert answer.stderr.endswith(f"{20 * '9'}...: 5000 characters in one word; allowed up to 4096\n"), answer.stderr


@pytest.mark.parametrize("words", [("check", "~nobody-here/x.yaml"), ("recordings", "list", "--rig", "~nobody-here/x")])
def test_a_home_of_nobody_is_a_name_like_another(words: tuple[str, ...], here: Path, call) -> None:
    """It was an internal error, and a traceback of `run`."""
    answer = call(*words)
    assert answer.exit_code in (2, 78) and "~nobody-here/x" in answer.stderr and "E500" not in answer.stderr


def test_a_rig_by_such_a_name_is_refused_in_words(here: Path) -> None:
    with pytest.raises(ProfileError, match="is no file"):
        load_rig("~nobody-here/x.yaml")
    with pytest.raises(ProfileError, match="'': an empty name"):
        load_rig("")


def test_a_certificate_in_such_a_home_is_looked_for_beside_the_rig(here: Path) -> None:
    face = TlsFace(type="tls", certificate="~nobody-here/a", key="~/b", ca="c").within(here)
    assert face.certificate == str(here / "~nobody-here/a") and face.key == str(here / "home" / "b")


def test_a_user_without_a_home_is_told_where_the_state_may_go(
    here: Path, call, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a container by a number alone each verb ended in an internal error."""

    def no_home() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("XDG_STATE_HOME")
    monkeypatch.setattr(Path, "home", no_home)
    for verb in (("events",), ("run", "demo", "--sim", "--bind", "127.0.0.1:0")):
        answer = call(*verb)
        assert answer.exit_code == 1
        assert answer.stderr.startswith(
            "E106 this user has no home directory for the state: set XDG_STATE_HOME, or give"
        )


def test_what_may_not_be_read_or_written_is_told_by_its_own_name(
    here: Path, call, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`restore` called it a wrong use of the verb, and `backup` named the file that it writes beside."""
    Path("b.tar.gz").write_text("")
    Path("state").mkdir()
    monkeypatch.setattr(os, "access", lambda *_, **__: False)
    assert "is not readable" not in call("restore", "b.tar.gz", "--state", "new").stderr
    answer = call("backup", "c.tar.gz", "--state", "state")
    told = "E105 c.tar.gz: Permission denied: this user may not; take another place, or chown it (force-gateway explain E105)\n"
    assert (answer.exit_code, answer.stderr) == (77, told)


@pytest.mark.parametrize("words", [("run", "demo", "--sim", "--bind", "127.0.0.1:0"), ("events",), ("audit", "show")])
def test_a_device_is_no_state_directory(words: tuple[str, ...], here: Path, call) -> None:
    """`run --state /dev/null` said that the file exists, and others that there is no such directory."""
    answer = call(*words, "--state", "/dev/null")
    assert answer.exit_code == 2 and "'/dev/null' is no directory" in answer.stderr, answer.output


@pytest.mark.parametrize(
    "line",
    [
        "recordings list", "plant list", "plant rollback", "report for-support.tar.gz", "events", "audit show", "record on",
        "calibration list", "calibration show", "calibration use 1", "calibration rollback", "sim list",
        "monitor --once", "write force_setpoint=1", "diagnose 1", "simulate 1 --rig demo", "fit 1",
    ],
)  # fmt: skip
def test_a_slip_in_state_is_told_by_each_verb_and_makes_no_directory(line: str, here: Path, call) -> None:
    """`recordings list` said nothing, and `report` and `rollback` spoke of a file within it that nobody knows."""
    answer = call(*line.split(), "--state", "typo")
    assert answer.exit_code == 65, answer.output
    assert answer.stderr == "E106 typo: there is no such state directory; --state DIR names another\n"
    assert not Path("typo").exists() and not Path("for-support.tar.gz").exists()


@pytest.mark.parametrize("target", ["nowhere", "link"])
@pytest.mark.parametrize(
    "words",
    [("certs", "link"), ("events", "--state", "link"), ("run", "demo", "--sim", "--state", "link")],
    ids=" ".join,
)
def test_a_link_that_leads_to_nothing_is_told_as_one(words: tuple[str, ...], target: str, here: Path, call) -> None:
    """A folder was to be made there, and 'File exists' came of it."""
    Path("link").symlink_to(target)
    answer = call(*words)
    assert (answer.exit_code, "'link' is a link to " + target in answer.stderr) == (2, True), answer.output


@pytest.mark.parametrize(
    ("kind", "told"),
    [("pipe", "is a pipe, and no rig file"), ("folder", "is a directory: name the file in it"),
     ("link", "is a link to nowhere, where no file is")],
)  # fmt: skip
def test_what_is_there_and_is_no_file_is_not_said_to_be_an_unknown_rig(kind: str, told: str, here: Path, call) -> None:
    os.mkfifo("pipe")
    Path("folder").mkdir()
    Path("link").symlink_to("nowhere")
    answer = call("registers", "--rig", f"./{kind}")
    assert answer.exit_code == 2 and answer.stderr.endswith(f"rig ./{kind} {told}\n")
