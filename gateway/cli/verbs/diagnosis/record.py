"""`record`: start and stop a recording in the gateway that runs; by its clock, too, so that it ends whatever becomes of us."""

import json
import sys
import time
from pathlib import Path
from typing import Any, Final

import click

from gateway.cli.command_line.duration import parse_duration_s
from gateway.cli.errors import CliError
from gateway.cli.options import StateChoice, json_option, label_name, state_options
from gateway.processes import exit_codes

_ON = {"on": True, "off": False}
_LOOK_S: Final = 0.2
_MOST_LOOKS: Final = 25  # five seconds, in which control is started again
_READER_S: Final = 1.0  # a reader that is merely slow has taken something by then
_LONGEST_S: Final = 31 * 86400.0


EXAMPLES = ("record on", "record off", "record --for 1s --name before-repair --note 'new seals come tomorrow'")


def _duration_s(context: click.Context, parameter: click.Parameter, value: str | None) -> float | None:
    """Return the seconds, for an option's callback."""
    if value is None:
        return None
    duration_s = parse_duration_s(value)
    if duration_s is None or not 0.0 < duration_s <= _LONGEST_S:
        raise click.BadParameter(f"{value} is no duration such as 60s, 10min or 2h (at most 31d)")
    return duration_s


def _note(context: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
    """Return what stands in one paragraph, for an option's callback."""
    if value is None:
        return None
    from gateway.recording.label import check_note

    try:
        return check_note(value)
    except ValueError as error:
        raise click.BadParameter(str(error)) from None


@click.command()
@click.argument("what", type=click.Choice(["on", "off", "status"]), required=False)
@click.option("--for", "for_s", callback=_duration_s, metavar="TIME", help="Record so long (60s, 10min), and wait.")
@click.option("--name", callback=label_name, help="What the recording is called.")
@click.option("--note", callback=_note, metavar="TEXT", help="What is to be known about it.")
@state_options
@json_option
def command(*, what: str | None, state: StateChoice, as_json: bool, for_s: float | None, **said: str | None) -> None:
    """Start or stop a recording in the running gateway.

    --for starts one that ends by itself; Ctrl-C ends it sooner and keeps it.
    """
    from gateway.cli.control_socket import ask

    label = {key: value for key, value in said.items() if value}
    starts = what == "on" or (what is None and bool(for_s or label))
    if not starts and (for_s or label):
        raise click.UsageError(f"--for, --name and --note are of a recording that starts, not of `record {what}`")
    request: dict[str, Any] = {"do": "record", **label}
    if for_s:
        request["for_s"] = for_s
    if starts or what in _ON:
        request["on"] = starts
    answer = _record(state.directory, request, for_s) if for_s else ask(state.directory, request)
    if not answer.get("stopped") or _is_read():
        click.echo(json.dumps(answer) if as_json else _sentence(answer))
    if for_s and answer["fault"]:
        raise CliError(f"{answer['fault']}: not the {for_s:g} s that were asked for")


def _is_read() -> bool:
    """Return whether a line on stdout has room; into a full pipe, whoever pressed Ctrl-C would have to press it again."""
    from gateway.cli.diagnosis.progress_line import takes_more

    return takes_more(sys.stdout, _READER_S)


def _record(state: Path, request: dict[str, Any], for_s: float) -> dict[str, Any]:
    """Begin a recording, wait for its end, and return what it has become. recording: the path that it began in; later: files in
    which it went on, as behind a restart of control or with another plant; fault: of the disk, that has ended it. A Ctrl-C
    before the answer counts behind it: the recording may have begun."""
    from gateway.cli.control_socket import ask
    from gateway.cli.diagnosis.progress_line import handle_interrupt, show_progress

    pressed: list[int] = []  # no Event: its lock may be held where the handler comes in
    with handle_interrupt(lambda number, frame: pressed.append(number)):
        recording: str = ask(state, request)["recording"]
    is_stopped, fault, files = False, "", [recording]
    try:
        if pressed:
            raise KeyboardInterrupt
        with show_progress("record"):
            fault = _wait(state, for_s, files)
    except KeyboardInterrupt:
        is_stopped = True
        fault = _ask_patiently(state, {"do": "record", "on": False}).get("fault") or ""
    sizes = [_size_of(Path(path)) for path in files]
    rows, duration_s = sum(size[0] for size in sizes), round(sum(size[1] for size in sizes), 6)
    answer = {"recording": None, "written": recording, "rows": rows, "duration_s": duration_s, "stopped": is_stopped}
    return {**answer, "fault": fault, "later": files[1:]}


def _size_of(path: Path) -> tuple[int, float]:
    """Return rows and length, s, of a file; one without a row is dropped where the disk has ended it."""
    from gateway.recording import read_entry

    try:
        entry = read_entry(path)
    except FileNotFoundError:
        return 0, 0.0
    return entry.rows, entry.duration_s


def _wait(state: Path, for_s: float, files: list[str]) -> str:
    """Look now and then until it is recorded no more, and tell how much of the time is over; return why it has ended before,
    empty where it has not. files: its first one; gets those in which it goes on."""
    from gateway.progress import report

    began_s = time.monotonic()
    while (status := _ask_patiently(state, {"do": "record"})).get("began_in") == files[0]:
        files += [status["recording"]] if status["recording"] not in files else []
        spent_s = time.monotonic() - began_s
        report(f"{Path(status['recording']).name}, seconds", min(int(spent_s), round(for_s)), max(round(for_s), 1))
        time.sleep(min(_LOOK_S, max(for_s - spent_s, 0.02)))
    return str(status.get("waits", ""))


def _ask_patiently(state: Path, request: dict[str, Any]) -> dict[str, Any]:
    """Ask control, which answers nobody for a moment while it is started again."""
    from gateway.cli.control_socket import ask

    for _ in range(_MOST_LOOKS):
        try:
            return ask(state, request)
        except CliError as error:
            if error.exit_code != exit_codes.DEVICE:
                raise
            time.sleep(_LOOK_S)
    return ask(state, request)


def _sentence(answer: dict[str, Any]) -> str:
    if answer.get("recording"):
        return f"recording to {answer['recording']}, {answer.get('rows', 0)} rows so far"
    if answer.get("written"):
        stopped = "stopped; " if answer.get("stopped") else ""
        length = f" ({answer['duration_s']:.1f} s)" if "duration_s" in answer else ""
        fault = f"; {answer['fault']}" if answer.get("fault") and "later" not in answer else ""
        later = f", then to {', '.join(answer['later'])}" if answer.get("later") else ""
        return f"{stopped}recorded {answer.get('rows', 0)} rows{length} to {answer['written']}{later}{fault}"
    return f"not recording: {answer['waits']}; it begins again by itself" if answer.get("waits") else "not recording"
