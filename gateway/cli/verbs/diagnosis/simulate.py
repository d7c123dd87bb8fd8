"""`simulate`: a plant run over a recording, and how far it is from what was measured."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gateway.cli.command_line.completion_words import complete_plant_files, complete_recordings
from gateway.cli.command_line.given_path import GivenPath
from gateway.cli.command_line.rig_choice import rig_option
from gateway.cli.command_line.table_options import table_options
from gateway.cli.options import json_option, state_option

if TYPE_CHECKING:
    from gateway.cli.diagnosis.inputs import Sources
    from gateway.diagnosis.measurement import Floats, Measurement

FORMAT = 1


EXAMPLES = ("simulate press.csv --rig demo", "simulate press.csv --plant paper-slide --csv simulated.csv")


@click.command()
@click.argument("recording", metavar="RECORDING", shell_complete=complete_recordings)
@rig_option("The rig whose plant is run  [default: the recording's own]")
@click.option(
    "--plant",
    metavar="PLANT.yaml",
    shell_complete=complete_plant_files,
    help="The plant to run, such as diagnose --extend writes; default the rig's.",
)
@table_options
@click.option("--csv", "csv_file", type=GivenPath(dir_okay=False), help="Write the simulated series.")
@state_option("State directory, for numbers.")
@json_option
def command(*, recording: str, as_json: bool, csv_file: Path | None, plant: str | None, **options: Any) -> None:
    """Run a plant over a recording, and compare the forces.

    RECORDING is what diagnose takes. Residuals are measured minus simulated.
    """
    from gateway.cli.diagnosis.inputs import read_sources
    from gateway.cli.diagnosis.outputs import check_targets, write_all
    from gateway.cli.diagnosis.progress_line import show_progress
    from gateway.cli.plants.simulated_reading import simulate_reading
    from gateway.extras import require
    from gateway.profiles import load_plant

    require("numba")
    profile = load_plant(plant) if plant else None
    sources = read_sources([recording], **options)
    measurement, profile = sources.measurements[0], profile or sources.plant
    check_targets(
        [csv_file] if csv_file else [],
        [*sources.paths, *(Path(name) for name in (plant, options["rig"], options["columns"]) if name)],
    )
    with show_progress("simulating"):
        simulated_n, notes = simulate_reading(measurement, profile)
    facts = _facts(measurement, simulated_n) | {
        "plant": profile.name,
        "notes": [*sources.notes, *measurement.notes, *notes],
    }
    if csv_file:
        write_all({csv_file: _table(measurement, simulated_n, facts)})
    if as_json:
        click.echo(json.dumps({"format": FORMAT, **facts}, indent=2, ensure_ascii=False))
    else:
        _show(sources, facts)
    if csv_file:
        click.echo(f"wrote {csv_file}", err=True)


def _facts(measurement: "Measurement", simulated_n: "Floats") -> dict[str, Any]:
    """Residuals over the rows that may be judged, and by direction of motion."""
    from gateway.reports.diagnosis.series import FALLING, RISING, direction

    left_n = measurement.force_n - simulated_n
    ways = direction(measurement)
    parts = {"all": measurement.usable}
    parts |= {name: measurement.usable & (ways == way) for name, way in (("rising", RISING), ("falling", FALLING))}
    return {
        "recording": measurement.name,
        "residual_n": {name: _figures(left_n[mask]) for name, mask in parts.items() if mask.any()},
        "duration_s": measurement.duration_s,
    }


def _figures(left_n: "Floats") -> dict[str, Any]:
    import numpy as np

    return {
        "rows": int(left_n.size),
        "rms_n": float(np.sqrt(np.mean(left_n * left_n))),
        "max_n": float(np.abs(left_n).max()),
        "mean_n": float(left_n.mean()),
    }


def _table(measurement: "Measurement", simulated_n: "Floats", facts: dict[str, Any]) -> str:
    """CSV of the recording contract, simulated_n and residual_n besides; usable: 1 where the row was judged."""
    import io

    import numpy as np

    columns = {"time_s": measurement.time_s, "force_n": measurement.force_n}
    if measurement.command_v is not None:
        columns["command_v"] = measurement.command_v
    if measurement.pressure_pa is not None:
        columns["pressure_kpa"] = measurement.pressure_pa / 1e3
    columns |= {"simulated_n": simulated_n, "residual_n": measurement.force_n - simulated_n}
    columns["usable"] = measurement.usable.astype(np.float64)
    text = io.StringIO()
    text.write(f"# recording: {facts['recording']}\n# plant: {facts['plant']}\n")
    np.savetxt(text, np.stack(list(columns.values()), axis=1), "%.9g", ",", header=",".join(columns), comments="")
    return text.getvalue()


def _show(sources: "Sources", facts: dict[str, Any]) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from gateway.reports.diagnosis.wording import force

    console = Console()
    console.print(f"{facts['recording']} · rig {sources.rig or 'not named'} · plant {facts['plant']}", highlight=False)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, header_style="dim")
    table.add_column("direction")
    for name in ("rows", "RMS N", "max N", "mean N"):
        table.add_column(name, justify="right", no_wrap=True)
    for name, part in facts["residual_n"].items():
        numbers = (force(part[key]) for key in ("rms_n", "max_n", "mean_n"))
        table.add_row(name, f"{part['rows']:,}".replace(",", " "), *numbers, style="bold" if name == "all" else None)
    console.print(table)
    for note in facts["notes"]:
        console.print(Text(f"note      {note}", style="dim"), soft_wrap=True)
