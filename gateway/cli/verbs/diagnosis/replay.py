"""`replay`: play a recording's commands and readings through the control code again, and tell what it decides otherwise."""

import json
from dataclasses import asdict
from math import isfinite
from typing import TYPE_CHECKING, Any

import click

from gateway.cli.command_line.completion_words import complete_calibrations, complete_recordings
from gateway.cli.options import StateChoice, json_option, state_options

if TYPE_CHECKING:
    from gateway.service.replayed_control import SignalDifference


EXAMPLES = ("replay 1", "replay 1 --against demo --json")


@click.command()
@click.argument("recording", metavar="RECORDING", shell_complete=complete_recordings)
@click.option(
    "--against",
    metavar="RIG|CALIBRATION",
    shell_complete=complete_calibrations,
    help="Another rig, or another calibration (number, file).",
)
@state_options
@json_option
def command(*, recording: str, against: str | None, state: StateChoice, as_json: bool) -> None:
    """Play RECORDING (a number, `last` or a file) through control again.

    Without --against its decisions are compared with the recorded ones, with --against those of two set-ups over the same
    readings. Readings stay as they were recorded: it shows what control would have wanted, not where the force would have gone.
    """
    from gateway.cli.diagnosis.progress_line import show_progress
    from gateway.cli.recordings.named_recording import recording_path
    from gateway.cli.recordings.setups import other_setup, own_setup
    from gateway.recording import read_table
    from gateway.service.replayed_control import compare_decisions, replay_control, tell_missing_rows

    table = read_table(recording_path(recording, state.rig, state.path))
    own, notes = own_setup(table, state)
    other = other_setup(against, own, state) if against else None
    with show_progress("replay"):
        first = replay_control(table, own)
        second = replay_control(table, other) if other else first
    before = first if other else table.columns
    differences = compare_decisions(table.columns["time_s"], before, second)
    names = (own.name, other.name) if other else ("recorded", f"replayed with {own.name}")
    if other is None and table.columns["state"][0]:
        notes.append("it begins while a force was on: control starts anew there, and its first seconds differ")
    if told := tell_missing_rows(table):
        notes.append(told)
    answer: dict[str, Any] = {"recording": str(table.path), "rows": table.rows, "one": names[0], "other": names[1]}
    if as_json:
        click.echo(
            json.dumps({**answer, "notes": notes, "differences": [_facts(one) for one in differences]}, indent=2)
        )
        return
    for note in notes:
        click.echo(note, err=True)
    click.echo(
        "\n".join(
            [f"{table.path}, {table.rows} rows", f"  {names[0]}", f"  against {names[1]}", "", *_table(differences)]
        )
    )


def _facts(difference: "SignalDifference") -> dict[str, Any]:
    facts = asdict(difference)
    return {key: None if isinstance(value, float) and not isfinite(value) else value for key, value in facts.items()}


def _table(differences: "list[SignalDifference]") -> list[str]:
    lines = [f"{'signal':<17}{'RMS':>10}{'largest':>12}{'at':>11}"]
    for one in differences:
        when = f"{one.at_s:.2f} s" if isfinite(one.at_s) else "-"
        if one.unit:
            lines.append(
                f"{one.signal:<17}{_number(one.rms, one.unit):>10}{_number(one.largest, one.unit):>12}{when:>11}"
            )
        else:
            rows = f"differs in {one.rows} rows" if one.rows else "equal"
            lines.append(f"{one.signal:<17}{rows:>22}{when:>11}")
    same = all(not one.rows for one in differences)
    return [*lines, "", "no difference"] if same else lines


def _number(value: float, unit: str) -> str:
    return f"{value:.3f} {unit}" if value else f"0 {unit}"
