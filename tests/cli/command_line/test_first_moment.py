"""The first moment of a command, before click can answer for it, and the terminal that it prints to."""

import io
import sys
from types import ModuleType

import pytest
from rich.console import Console

import gateway.cli.main
from gateway.__main__ import main


class ReadWhenCtrlCComes(ModuleType):
    """A module that is just being read."""

    def __getattr__(self, name: str) -> object:
        raise KeyboardInterrupt


def test_ctrl_c_while_the_first_modules_are_read_shows_no_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "gateway.cli.main", ReadWhenCtrlCComes("gateway.cli.main"))
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == "Aborted!"


@pytest.mark.parametrize(("encoding", "printed"), [("ascii", "rig ? S?d"), ("latin-1", "rig · Süd")])
def test_what_a_terminal_cannot_print_ends_no_verb(
    monkeypatch: pytest.MonkeyPatch, encoding: str, printed: str
) -> None:
    terminal = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(terminal, encoding, write_through=True))
    monkeypatch.setattr(gateway.cli.main, "command", lambda **_: Console().print("rig · Süd"))
    gateway.cli.main.main()
    assert terminal.getvalue().decode(encoding).strip() == printed
