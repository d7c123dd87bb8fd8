"""`metrics`: the running gateway's own figures as text that Prometheus reads, through a file (textfile collector) or a pipe.

The same series are served by `run --metrics`; `--grafana` and `--telegraf` print files that show and collect them.
"""

from importlib.resources import files

import click

from gateway.cli.options import StateChoice, state_options
from gateway.live.live_state import LiveState

EXAMPLES = ("metrics", "metrics --rig demo")


@click.command()
@state_options
@click.option("--grafana", "file", flag_value="grafana.json", help="Print a Grafana dashboard of these series instead.")
@click.option("--telegraf", "file", flag_value="telegraf.conf", help="Print a Telegraf configuration instead.")
def command(*, state: StateChoice, file: str | None) -> None:
    """Print the gateway's own figures, in Prometheus' text format."""
    if file:
        click.echo((files("gateway.telemetry") / "dashboards" / file).read_text(encoding="utf-8"), nl=False)
        return
    from gateway.cli.control_socket import ask
    from gateway.telemetry.exposition import exposition
    from gateway.telemetry.series import GatewayReading

    answer = LiveState.from_json(ask(state.directory, {"do": "state"}))
    click.echo("\n".join(exposition(GatewayReading(answer, ask(state.directory, {"do": "health"})))))
