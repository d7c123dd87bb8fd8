"""`metrics`: the running gateway's own figures as text that Prometheus reads, through a file (textfile collector) or a pipe.

Names and units follow Prometheus' custom: base units, `_total` for counters. A figure that is not known is left out.
"""

from collections.abc import Iterator
from typing import Any, Final

import click

from gateway.cli.options import StateChoice, state_options

_PREFIX: Final = "force_gateway_"
_LOOP: Final = (
    ("ticks", "loop_ticks_total", "counter", 1.0, "Periods of the control loop."),
    ("missed_ticks", "loop_missed_ticks_total", "counter", 1.0, "Periods that passed without a step."),
    ("loop_time_us", "loop_step_seconds", "gauge", 1.0e-6, "Work of the last step."),
    ("late_p50_us", "loop_late_p50_seconds", "gauge", 1.0e-6, "Half of all steps began no later than this."),
    ("late_p99_us", "loop_late_p99_seconds", "gauge", 1.0e-6, "99 of 100 steps began no later than this."),
)
_RESIDUAL: Final = (
    ("cause", "residual_cause", "gauge", 1.0, "What the model differs by: 0 nothing, 99 unknown, else the register's."),
    ("warnings", "residual_warnings_total", "counter", 1.0, "How often that warning rose."),
    ("age_s", "residual_age_seconds", "gauge", 1.0, "Since the watch last spoke."),
    ("looks", "residual_looks_total", "counter", 1.0, "Windows that the watch looked at."),
    ("judged", "residual_judged_total", "counter", 1.0, "Windows that it could judge."),
    ("skipped", "residual_skipped_total", "counter", 1.0, "Windows that held too little."),
    ("cpu_s", "residual_cpu_seconds_total", "counter", 1.0, "Processor time of the watch."),
    ("rms_n", "residual_rms_newtons", "gauge", 1.0, "Difference of model and cell in the last window, RMS."),
    ("floor_n", "residual_floor_newtons", "gauge", 1.0, "The noise in it."),
    ("pause_s", "residual_pause_seconds", "gauge", 1.0, "Until the watch looks again."),
)


EXAMPLES = ("metrics", "metrics --rig demo")


@click.command()
@state_options
def command(*, state: StateChoice) -> None:
    """Print the running gateway's own figures, in Prometheus' text format."""
    from gateway.cli.control_socket import ask

    click.echo("\n".join(exposition(ask(state.directory, {"do": "health"}))))


def exposition(health: dict[str, Any]) -> Iterator[str]:
    """Yield lines of the text format, version 0.0.4, of the control socket's answer."""
    for figures, table in ((health, _LOOP), (health.get("residual") or {}, _RESIDUAL)):
        for key, name, kind, scale, help_text in table:
            value = figures.get(key)
            if isinstance(value, (int, float)):
                yield f"# HELP {_PREFIX}{name} {help_text}"
                yield f"# TYPE {_PREFIX}{name} {kind}"
                yield f"{_PREFIX}{name}{_label(figures, key)} {value * scale:.10g}"


def _label(figures: dict[str, Any], key: str) -> str:
    return f'{{name="{figures["name"]}"}}' if key == "cause" and "name" in figures else ""
