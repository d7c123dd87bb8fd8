"""The first moment of a command, before click can answer for it."""

import sys
from types import ModuleType

import pytest

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
