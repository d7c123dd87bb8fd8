"""The metrics as a process: `python -m gateway.telemetry.metrics_process LINK '{"state": ..., "listen": descriptor, ...}'`.

It asks control when it is asked itself, keeps nothing, and so has no old values to show: where control does not answer,
`force_gateway_up` is 0 and stands alone. Its priority is below control's; it ends with the guardian.
"""

import socket
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gateway.extras import import_library
from gateway.live.control_link import ControlLink
from gateway.live.live_state import LiveState
from gateway.processes.beside_control import serve_until_guardian_ends
from gateway.processes.event_log import EventLog
from gateway.telemetry.series import GatewayReading, samples_of

if TYPE_CHECKING:
    from prometheus_client import Metric
    from starlette.applications import Starlette
    from starlette.requests import Request
    from starlette.responses import Response


class ReadingCollector:
    """What Prometheus' registry asks for the series of one reading."""

    def __init__(self, reading: GatewayReading | None) -> None:
        self._reading = reading

    def collect(self) -> "Iterator[Metric]":
        """Yield the series that are known."""
        from prometheus_client import Metric

        for series, samples in samples_of(self._reading):
            metric = Metric(series.name.removesuffix("_total"), series.help, series.kind)
            for labels, value in samples:
                metric.add_sample(series.name, labels, value)
            yield metric


async def read_gateway(link: ControlLink) -> GatewayReading | None:
    """Return what control answers now; None where it does not."""
    try:
        state = LiveState.from_json(await link.ask({"do": "state"}))
        return GatewayReading(state, await link.ask({"do": "health"}))
    except (OSError, ValueError):
        return None


def make_metrics_app(state_directory: Path) -> "Starlette":
    """Return the application that serves /metrics. MissingExtraError without prometheus-client."""
    prometheus = import_library("prometheus_client")
    from prometheus_client.exposition import choose_encoder
    from starlette.applications import Starlette
    from starlette.responses import Response
    from starlette.routing import Route

    link = ControlLink(state_directory)

    async def metrics(request: "Request") -> "Response":
        registry = prometheus.CollectorRegistry(auto_describe=False)
        registry.register(ReadingCollector(await read_gateway(link)))
        try:
            encode, content_type = choose_encoder(request.headers.get("accept", ""))
        except (TypeError, ValueError):  # the library's, of a version that is no number
            encode, content_type = choose_encoder("")
        return Response(encode(registry), headers={"content-type": content_type, "cache-control": "no-store"})

    return Starlette(routes=[Route("/metrics", metrics)])


async def serve(options: dict[str, Any], _: EventLog) -> None:
    """Serve until the process ends. options: as the guardian gives them."""
    app = make_metrics_app(Path(options["state"]))
    import uvicorn

    from gateway.web.bounded_http import BoundedHttpProtocol

    config = uvicorn.Config(
        app,
        http=BoundedHttpProtocol,
        log_config=None,
        access_log=False,
        server_header=False,
        ws="none",
        lifespan="off",
        limit_concurrency=32,
    )
    await uvicorn.Server(config).serve(sockets=[socket.socket(fileno=options["listen"])])


def main(arguments: list[str]) -> int:
    """Serve until the guardian ends. arguments: descriptor of the link, options as JSON."""
    return serve_until_guardian_ends("metrics", arguments, serve)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
