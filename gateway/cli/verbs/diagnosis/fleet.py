"""`fleet`: fit or diagnose many recordings of many cells, here or on a Dask cluster, and say which cells drift and why."""

import json
import os
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gateway.cli.command_line.given_path import GivenPath
from gateway.cli.command_line.numbers import Whole
from gateway.cli.command_line.rig_choice import rig_option
from gateway.cli.command_line.table_options import table_options
from gateway.cli.errors import CliError, already_exists
from gateway.cli.options import count_of, json_option
from gateway.cli.subcommands import SubcommandGroup
from gateway.plain_file import exists, is_file
from gateway.processes import exit_codes

if TYPE_CHECKING:
    from gateway.fleet.engines import Engine
    from gateway.fleet.kept_rows import KeptRows
    from gateway.fleet.tasks import Row, Task

Function = Callable[..., Any]


@click.group(name="fleet", cls=SubcommandGroup)
def command() -> None:
    """Fit or diagnose many recordings of many cells."""


def _fleet_options(function: Function) -> Function:
    options = (
        click.argument("patterns", metavar="PATTERN...", nargs=-1, required=True),
        click.option(
            "--scheduler",
            default="processes",
            show_default=True,
            metavar="serial|processes|tcp://HOST:PORT",
            help="Who computes; tcp: a Dask scheduler.",
        ),
        click.option("--workers", type=Whole(1, 256), default=os.cpu_count() or 1, help="Processes  [default: cores]"),
        click.option("--output", "-o", type=GivenPath(file_okay=False), help="Folder  [default: fleet-VERB]"),
        click.option("--fresh", is_flag=True, help="Compute everything anew, also what is kept from an earlier run."),
        table_options,
        rig_option("The rig of all of them  [default: each recording's own]"),
        json_option,
    )
    for option in reversed(options):
        function = option(function)
    return function


EXAMPLES = (
    "fleet diagnose 'recordings/cell=*/date=*/*.csv' --scheduler serial -o why",
    "fleet fit 'recordings/cell=*/date=*/*.csv' --scheduler serial --json -o fits",
)


@command.command(name="diagnose")
@_fleet_options
def diagnose_command(**options: Any) -> None:
    """Diagnose every recording that PATTERN finds, and say which cells drift and why.

    Cell and date come from folders such as cell=7/date=2026-11-23. Quote the pattern: the shell need not expand it. What is
    finished is kept as it comes, and taken over by the next call. Exit code 65 where a recording could not be read.
    """
    _use_one_thread()
    from gateway.cli.fleet.rows import DIAGNOSE_COLUMNS, Question, diagnose_row
    from gateway.extras import require

    require("numba")
    question = Question(_absolute(options["rig"]), _absolute(options["columns"]))
    _work("diagnose", partial(diagnose_row, question), DIAGNOSE_COLUMNS, options)


@command.command(name="fit")
@_fleet_options
def fit_command(**options: Any) -> None:
    """Fit every ladder that PATTERN finds, and say which cells drift.

    As `fleet diagnose`; what is watched is the fitted force at the middle of the voltages.
    """
    _use_one_thread()
    from gateway.cli.fleet.rows import FIT_COLUMNS, Question, fit_row

    question = Question(_absolute(options["rig"]), _absolute(options["columns"]))
    _work("fit", partial(fit_row, question), FIT_COLUMNS, options)


def _use_one_thread() -> None:
    """Before numpy is loaded: two threads add in another order than one, and rows would differ from those of workers."""
    os.environ["OPENBLAS_NUM_THREADS"] = "1"


def _absolute(name: str | None) -> str | None:
    """A worker elsewhere has another directory; a shipped name stays one."""
    return str(Path(name).absolute()) if name and is_file(name) else name


def _work(verb: str, compute: "Callable[[Task], Row]", columns: Sequence[str], options: dict[str, Any]) -> None:
    from gateway.cli.diagnosis.progress_line import show_progress
    from gateway.cli.fleet.files import KEPT, write_files
    from gateway.extras import require
    from gateway.fleet.drift import find_drifts, undated
    from gateway.fleet.kept_rows import KeptRows
    from gateway.fleet.page import headline
    from gateway.fleet.tasks import find_tasks

    require("pyarrow")
    folder = options["output"] or Path(f"fleet-{verb}")
    own = _own_files(folder, is_fresh=options["fresh"])
    tasks = [task for task in find_tasks(options["patterns"]) if Path(task.path).resolve() not in own]
    if not tasks:
        raise CliError(f"E190 no file matches {' '.join(options['patterns'])}; quote the pattern", exit_codes.DATA)
    engine = partial(_engine_of(options["scheduler"], options["workers"]), compute)
    if options["fresh"]:
        (folder / KEPT).unlink(missing_ok=True)
    with show_progress(f"fleet {verb}"):
        rows, taken_over = _compute(tasks, engine, KeptRows(folder / KEPT, _question(verb, options)))
    rows = [_with_all(columns, row) for row in rows]
    cells = find_drifts(rows)
    files = write_files(folder, rows, cells, verb)
    failed = [row for row in rows if row["error_code"]]
    _tell_undated(undated(rows))
    if options["as_json"]:
        from gateway.cli.fleet.files import cell_row

        facts = {"recordings": len(rows), "errors": len(failed), "taken_over": taken_over, "answer": headline(cells)}
        click.echo(json.dumps(facts | {"cells": [cell_row(one) for one in cells], "files": list(map(str, files))}))
    else:
        from gateway.cli.fleet.cell_table import print_cells

        click.echo(headline(cells))
        print_cells(cells)
        _tell(rows, failed, taken_over, files)
    if failed:
        raise click.exceptions.Exit(exit_codes.DATA)


def _own_files(folder: Path, *, is_fresh: bool) -> set[Path]:
    """Return the files that are written there; a pattern may find those of an earlier run. CliError E405 for one that none has
    left."""
    from gateway.cli.fleet.files import KEPT, WRITTEN

    found = [folder / name for name in WRITTEN if exists(folder / name)]
    if found and not is_fresh and not exists(folder / KEPT):
        raise already_exists(found[0], "-o names another folder, --fresh takes this one")
    return {(folder / name).resolve() for name in (*WRITTEN, KEPT)}


def _with_all(columns: Sequence[str], row: "Row") -> "Row":
    """A row of an error has every column, too."""
    whole = dict.fromkeys(("file", "cell", "date", "sha256", *columns, "error_code", "error")) | row
    return whole | {"causes": whole["causes"] or []}


def _compute(
    tasks: "Sequence[Task]", engine: "Callable[[Sequence[Task]], Iterator[tuple[Task, Row]]]", kept: "KeptRows"
) -> "tuple[list[Row], int]":
    """Return a row for every task in their order, and how many of them were kept from before."""
    from gateway import progress
    from gateway.fleet.engines import EngineError

    rows = kept.known(list(tasks))
    missing, taken_over = [task for task in tasks if task not in rows], len(rows)
    progress.report("recordings", len(rows), len(tasks))
    try:
        with kept:
            for task, row in engine(missing):
                kept.keep(row)
                rows[task] = row
                progress.report("recordings", len(rows), len(tasks))  # serially a recording has told of its own stages
    except KeyboardInterrupt:
        click.echo(f"\n{len(rows)} of {len(tasks)} rows are kept; the same command goes on from there", err=True)
        raise
    except EngineError as error:
        raise CliError(str(error), exit_codes.DEVICE) from None
    return [rows[task] for task in tasks], taken_over


def _question(verb: str, options: dict[str, Any]) -> dict[str, Any]:
    """Everything besides the file that an answer depends on."""
    from gateway import VERSION
    from gateway.plain_file import read_plain
    from gateway.profiles import read_rig

    rig = read_rig(options["rig"]).fingerprint if options["rig"] else ""
    mapping = read_plain(options["columns"]).decode() if options["columns"] else ""
    return {"verb": verb, "version": VERSION, "rig": rig, "columns": mapping}


def _engine_of(name: str, workers: int) -> "Engine":
    from gateway.fleet.engines import cluster, processes, run_serially

    if name == "serial":
        return run_serially
    if name == "processes":
        return processes(workers)
    if name.startswith(("tcp://", "tls://")):
        from gateway.extras import require

        require("distributed")
        return cluster(name)
    raise click.UsageError(f"--scheduler {name}: serial, processes or tcp://HOST:PORT of a Dask scheduler")


def _tell_undated(rows: "list[Row]") -> None:
    """A folder `date=23.11.2026` would else be a cell without days, and nothing said why."""
    if rows:
        where = f"{rows[0]['file']}{' and others' if rows[1:] else ''}"
        click.echo(f"no trend counts {count_of(rows, 'recording')}: in no folder date=YYYY-MM-DD ({where})", err=True)


def _tell(rows: "list[Row]", failed: "list[Row]", taken_over: int, files: list[Path]) -> None:
    before = f", {taken_over} of them kept from before" if taken_over else ""
    click.echo(f"{count_of(rows, 'recording')}{before}; {len(failed)} could not be read")
    for row in failed[:5]:
        click.echo(f"  {row['file']}: {row['error_code']} {row['error']}", err=True)
    if len(failed) > 5:
        click.echo(f"  and {len(failed) - 5} more: rows.parquet has all", err=True)
    click.echo("wrote " + ", ".join(map(str, files)))
