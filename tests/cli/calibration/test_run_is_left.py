"""A run of which only the fit is left is left at once by whatever ends the terminal."""

import os
import signal
from dataclasses import replace

import pytest

from gateway.cli.calibration import follow as following
from gateway.cli.calibration.follow import follow_run
from gateway.cli.calibration.runs import RunStatus
from gateway.cli.errors import CliError
from tests.cli.calibration.test_run_is_stopped import Climbing


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_end_during_the_fit_is_not_kept_waiting_for_it(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing presses any more: for a minute Ctrl-C did nothing that anybody saw, and `timeout` had to kill."""
    monkeypatch.setattr(following, "_POLL_S", 0.0)

    class Fitting(Climbing):
        def look(self) -> RunStatus:
            return replace(super().look(), phase="fitting")

    run = Fitting(lambda: os.kill(os.getpid(), number))
    before = signal.signal(number, signal.default_int_handler)
    try:
        with pytest.raises(CliError, match="the gateway goes on fitting") as left:
            follow_run(run)
    finally:
        signal.signal(number, before)
    assert left.value.exit_code == 128 + number and "force-gateway calibration list" in left.value.message
