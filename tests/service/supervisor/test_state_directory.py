"""The state directory that a first start makes: calibrations, recordings and who has written what are its owner's business."""

import os
import stat
from collections.abc import Iterator
from pathlib import Path

import pytest

from gateway.service.supervisor import guardian
from gateway.service.supervisor.run_options import RunOptions


@pytest.fixture
def generous_umask() -> Iterator[None]:
    """Takes nothing away: what is seen is what was asked for."""
    previous = os.umask(0)
    yield
    os.umask(previous)


class _EnoughSeenError(Exception):
    """The directory is there; nothing need be started in it."""


@pytest.mark.usefixtures("generous_umask")
def test_the_state_directory_is_for_its_owner_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def stop(path: Path) -> None:
        raise _EnoughSeenError(path)

    monkeypatch.setattr(guardian, "hold_state_lock", stop)
    state = tmp_path / "force-gateway" / "demo"
    with pytest.raises(_EnoughSeenError):
        guardian.run(RunOptions(state=state))
    assert stat.S_IMODE(state.stat().st_mode) == 0o700
