"""Every command on README and on the pages beside the rooms: its verb and options are there; README's run as they stand.

What needs hardware or root, or lasts for ever, is named in NOT_HERE with its reason; in the push gate options are read only.
"""

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from gateway.cli.main import command
from tests.end_to_end.conftest import RunningGateway, start, stop
from tests.end_to_end.test_examples import leaf_of

ROOT = Path(__file__).parents[2]
PAGES = [
    ROOT / "README.md",
    *(page for room in ("gateway", "profiles", "tools") for page in (ROOT / room).rglob("*.md")),
]
STANDING_FOR = {"FILE": "demo", "HOST": "127.0.0.1", "HOST:8802": "127.0.0.1:8802", "DIR": "certificates"}
"""What a page says for something of the reader's own."""
NOT_HERE = {
    "monitor": "lasts until q",
    "run": "lasts; my-cell.yaml has ports that nobody has",
    "check my-cell.yaml --probe": "there are no devices",
    "service": "asks for root and systemd",
    "calibrate --resume": "nothing was cut",
    "diagnose 3": "the third recording is the next year's",
}
ENDED = {"hold": ["--for", "2s"], "calibrate": ["--yes"]}
"""What makes a command end by itself that asks or lasts."""


def commands_of(page: Path) -> Iterator[list[str]]:
    """Yield the words behind `force-gateway` of each command in a block of the page."""
    for line in page.read_text(encoding="utf-8").splitlines():
        if not re.match(r"^(    |\$ )?(sudo )?(\.venv/bin/)?force-gateway ", line):
            continue
        for part in re.split(r"\s+# ", line.removeprefix("$ "))[0].split(";"):
            words = shlex.split(part)
            if "force-gateway" in (Path(word).name for word in words):
                at = [Path(word).name for word in words].index("force-gateway")
                yield [STANDING_FOR.get(word, word) for word in words[at + 1 :] if word != "sudo"]


def without_redirection(words: list[str]) -> list[str]:
    return words[: words.index(">")] if ">" in words else words


COMMANDS = [(page, without_redirection(words)) for page in PAGES for words in commands_of(page)]


def unread(words: list[str]) -> str:
    """What click says of a verb's options that it does not know; files need not be there."""
    leaf = leaf_of(words)
    rest = words[2:] if isinstance(command.get_command(click.Context(command), words[0]), click.Group) else words[1:]
    known = {name for parameter in leaf.params for name in (*parameter.opts, *parameter.secondary_opts)}
    return ", ".join(
        word for word in rest if re.match(r"--?[a-z]", word) and word.partition("=")[0] not in known | {"--help"}
    )


def test_every_command_of_a_page_has_a_verb_and_options_that_are_there() -> None:
    assert len(COMMANDS) > 100
    complaints = [
        f"{page.relative_to(ROOT)}: {' '.join(words)}: {bad}" for page, words in COMMANDS if (bad := unread(words))
    ]
    assert not complaints, "\n".join(complaints)


@pytest.mark.long
@pytest.mark.usefixtures("tracker_process")
def test_readme_s_commands_run_in_their_order(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From an empty directory beside one gateway: force, calibration, recording, diagnosis, fleet."""
    state, here = tmp_path / "force-gateway" / "demo", tmp_path / "here"
    here.mkdir()
    state.parent.mkdir()
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.chdir(here)
    gateway, ran = start(state, "--sim"), 0
    try:
        for page, words in COMMANDS:
            line = " ".join(words)
            if page != ROOT / "README.md" or any(line.startswith(start) for start in NOT_HERE):
                continue
            if words[0] == "fleet":
                export("1", here / "recordings/cell=1/date=2026-11-23/0001.parquet")
            port = ["--gateway", port_of(gateway)]
            if words[0] in ("calibrate", "upload") or not any(one.name == "endpoint" for one in leaf_of(words).params):
                port = port if words[0] == "upload" else []
            if words[0] == "calibrate":
                gateway.rest()
            done = CliRunner().invoke(command, [*words, *ENDED.get(words[0], []), *port])
            assert done.exit_code == 0, f"{line}\n{done.output}"
            if words[0] == "init":
                edit(here / "my-cell.yaml")
            if line == "record on":
                assert (
                    CliRunner().invoke(command, ["hold", "9", "--for", "3s", "--gateway", port_of(gateway)]).exit_code
                    == 0
                )
            ran += 1
    finally:
        stop(gateway)
    assert ran >= 20


def port_of(gateway: RunningGateway) -> str:
    return f"127.0.0.1:{gateway.port}"


def edit(rig: Path) -> None:
    """What the reader does with the lines that EDIT marks."""
    rig.write_text(rig.read_text().replace("EDIT-", "usb-FTDI_"))


def export(number: str, path: Path) -> None:
    path.parent.mkdir(parents=True)
    assert CliRunner().invoke(command, ["recordings", "export", number, "--parquet", "-o", str(path)]).exit_code == 0
