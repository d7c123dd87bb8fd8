"""Prometheus' text format, version 0.0.4, without its library: for the verb `metrics`, which every install has."""

from collections.abc import Iterator
from typing import Final

from gateway.telemetry.series import GatewayReading, Labels, samples_of

_ESCAPES: Final = str.maketrans({"\\": "\\\\", '"': '\\"', "\n": "\\n"})


def exposition(reading: GatewayReading | None) -> Iterator[str]:
    """Yield the lines."""
    for series, samples in samples_of(reading):
        yield f"# HELP {series.name} {series.help}"
        yield f"# TYPE {series.name} {series.kind}"
        for labels, value in samples:
            yield f"{series.name}{_written(labels)} {value:.10g}"


def _written(labels: Labels) -> str:
    pairs = ",".join(f'{name}="{value.translate(_ESCAPES)}"' for name, value in labels.items())
    return f"{{{pairs}}}" if pairs else ""
