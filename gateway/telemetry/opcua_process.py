"""An OPC UA server as a process: `python -m gateway.telemetry.opcua_process LINK '{"rig": ..., "state": ..., ...}'`.

Read only: it has no variable that a client may write, and no method. It serves the metrics of the Sparkplug node as variables
below one object; where control does not answer they are BadNoCommunication, and a value that is not known is BadNoData. It ends
with the guardian.
"""

import asyncio
import logging
import sys
import time
from datetime import UTC, datetime
from importlib import import_module
from pathlib import Path
from typing import Any, Final

from gateway.extras import import_library
from gateway.live.control_link import ControlLink
from gateway.live.live_state import LiveState
from gateway.processes.beside_control import serve_until_guardian_ends
from gateway.processes.event_log import EventLog
from gateway.telemetry.opcua_connections import bound_connections, bound_publishing
from gateway.telemetry.sparkplug_metrics import NODE_METRICS, values_of
from gateway.telemetry.sparkplug_payload import DataType, Value

NAMESPACE: Final = "urn:force-gateway"
LOOK_S: Final = 0.2
_EMPTY: Final[dict[DataType, Value]] = {
    DataType.UINT64: 0,
    DataType.DOUBLE: 0.0,
    DataType.BOOLEAN: False,
    DataType.STRING: "",
}


class GatewayNodes:
    """The variables of a server. asyncua: its library, imported."""

    def __init__(self, ua: Any, server: Any) -> None:
        self._ua, self._server = ua, server
        self._types = {
            DataType.UINT64: ua.VariantType.UInt64,
            DataType.DOUBLE: ua.VariantType.Double,
            DataType.BOOLEAN: ua.VariantType.Boolean,
            DataType.STRING: ua.VariantType.String,
        }
        self._nodes: dict[str, Any] = {}

    async def add(self, rig: str) -> None:
        """Add the rig's object with a variable for each metric, which only this process can change."""
        place = await self._server.register_namespace(NAMESPACE)
        objects = self._server.nodes.objects
        gateway = await objects.add_object(self._ua.NodeId(rig, place), f"{place}:{rig}")
        for metric in NODE_METRICS:
            address = self._ua.NodeId(f"{rig}/{metric.name}", place)
            name = self._ua.QualifiedName(metric.name, place)
            self._nodes[metric.name] = await gateway.add_variable(
                address, name, _EMPTY[metric.datatype], self._types[metric.datatype]
            )

    async def show(self, state: LiveState | None) -> None:
        """Give each variable its value of now."""
        now = datetime.now(UTC)
        for metric, value in zip(NODE_METRICS, values_of(state).values(), strict=True):
            await self._server.write_attribute_value(
                self._nodes[metric.name].nodeid,
                self._data_value(metric.datatype, value, now, is_there=state is not None),
            )

    def _data_value(self, datatype: DataType, value: Value, now: datetime, *, is_there: bool) -> Any:
        codes = self._ua.StatusCodes
        missing = codes.BadNoData if is_there else codes.BadNoCommunication
        return self._ua.DataValue(
            self._ua.Variant(_EMPTY[datatype] if value is None else value, self._types[datatype]),
            self._ua.StatusCode(codes.Good if value is not None else missing),
            now,
        )


async def serve(options: dict[str, Any], log: EventLog) -> None:
    """Serve until the process ends. options: as the guardian gives them; settings: rig's name and where to listen."""
    asyncua = import_library("asyncua")
    logging.getLogger("asyncua").setLevel(logging.CRITICAL)  # its log is for its developers
    bound_connections(import_module("asyncua.server.binary_server_asyncio"), log)
    server = asyncua.Server()
    await server.init()
    bound_publishing(server.iserver.subscription_service, LOOK_S)
    settings = options["settings"]
    server.set_endpoint(place := f"opc.tcp://{settings['listen']}/")
    server.set_server_name("force-gateway")
    server.set_security_policy([asyncua.ua.SecurityPolicyType.NoSecurity])
    server.allow_remote_admin(False)  # else whoever calls himself admin may write and delete every node
    nodes = GatewayNodes(asyncua.ua, server)
    await nodes.add(settings["name"])
    link = ControlLink(Path(options["state"]))
    await nodes.show(await _look(link))
    try:
        async with server:
            log("start", f"OPC UA is served: {place}")  # its library takes seconds to load, on a busy machine a minute
            await _show_forever(nodes, link)
    except OSError as error:
        log("start", f"E127 opcua.listen: {error.strerror or error}")


async def _show_forever(nodes: GatewayNodes, link: ControlLink) -> None:
    while True:
        began_s = time.monotonic()
        await nodes.show(await _look(link))
        await asyncio.sleep(max(0.0, LOOK_S - (time.monotonic() - began_s)))


async def _look(link: ControlLink) -> LiveState | None:
    try:
        return LiveState.from_json(await link.ask({"do": "state"}))
    except (OSError, ValueError):
        return None


def main(arguments: list[str]) -> int:
    """Serve until the guardian ends. arguments: descriptor of the link, options as JSON."""
    return serve_until_guardian_ends("opcua", arguments, serve)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
