"""Follows a run to its end with a progress bar; Ctrl-C, SIGTERM and a closed terminal take the force to 0, a second one leaves
at once."""

import time
from math import isnan
from typing import Any, Final

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TaskID, TaskProgressColumn, TextColumn

from gateway.cli.calibration.runs import ENDED, Run, RunStatus
from gateway.cli.errors import CliError
from gateway.cli.master.ending_signals import signals_as_ctrl_c, watch_to_the_end
from gateway.processes import exit_codes

_POLL_S: Final = 0.2
_BEGIN_S: Final = 2.0
_LEAST_WIDTH: Final = 76
_NAMES: Final = {
    "idle": "starting",
    "zero": "zero and noise",
    "check": "sign and scale",
    "ladder": "ladder",
    "minor_loops": "reversals",
    "fitting": "fitting",
    "stored": "stored",
    "refused": "fit refused",
    "stopped": "stopped",
    "experiment": "experiment",
    "recorded": "recorded",
}


class NotBegunError(CliError):
    """Nothing has moved."""


class RestartedError(CliError):
    """The gateway is another one by now, which knows of no run."""


def follow_run(run: Run) -> dict[str, Any]:
    """Begin the run and wait for its end; return how it ended. exit_code: of a verb that a signal has ended."""
    with signals_as_ctrl_c():
        if not (number := watch_to_the_end(run.begin, lambda: _watch(run), run.stop)):
            return run.end()
        code = exit_codes.BY_SIGNAL + number
        _leave_fit(run, code)
        _watch(run)  # on its way to 0
    return run.end() | {"exit_code": code}


def _leave_fit(run: Run, code: int) -> None:
    """Leave a run of which only the fit is left: nothing presses, and nobody is needed for it. code: the verb's, then."""
    if run.look().phase == "fitting":
        goes_on = "the ladder is done, nothing presses, and the gateway goes on fitting"
        raise CliError(f"left: {goes_on}; force-gateway calibration list has the calibration then", code)


def _watch(run: Run) -> None:
    """Show the run until it has ended."""
    try:
        with _progress() as progress:
            _wait(run, progress, progress.add_task("starting", total=1.0, force="", eta=""))
    except (NotBegunError, RestartedError):
        raise
    except CliError as error:
        raise CliError(f"{error.format_message()}\n{run.lost_words}", error.exit_code) from None


def _progress() -> Progress:
    """Return the bar, with the force and the time left; on a narrow terminal without the bar."""
    console = Console(stderr=True)
    share, force = TaskProgressColumn(), TextColumn("{task.fields[force]:>18}")
    left = TextColumn("{task.fields[eta]:>9}")
    if console.width < _LEAST_WIDTH:
        force, left = TextColumn("{task.fields[force]}"), TextColumn("{task.fields[eta]}")
        return Progress(TextColumn("{task.description}"), share, force, left, console=console)
    bar = (SpinnerColumn(), TextColumn("{task.description:<22}"), BarColumn(bar_width=None))
    return Progress(*bar, share, force, left, console=console, expand=True)


def _wait(run: Run, progress: Progress, task: TaskID) -> None:
    began_s, has_begun = time.monotonic(), False
    while True:
        look = run.look()
        has_begun = has_begun or look.phase != "idle"
        name = f"{_NAMES.get(look.phase, look.phase)}{look.detail}"
        progress.update(task, completed=look.progress, description=name, force=_force(look), eta=_eta(look))
        if look.phase in ENDED:
            return
        if look.phase == "idle" and has_begun:
            raise RestartedError(
                "A401 the gateway has started anew, in OFF, and the run has ended with it: its log has the first cause; what "
                "was recorded is kept there"
            )
        if look.phase == "idle" and time.monotonic() - began_s > _BEGIN_S:
            raise NotBegunError("W305 the gateway has not begun the calibration; its log says why")
        time.sleep(_POLL_S)


def _force(look: RunStatus) -> str:
    return "" if isnan(look.force_n) else f"{look.voltage_v:.2f} V {look.force_n:.2f} N"


def _eta(look: RunStatus) -> str:
    if isnan(look.eta_s) or look.eta_s <= 0.0:
        return ""
    return f"{int(look.eta_s) // 60}:{int(look.eta_s) % 60:02d} left"
