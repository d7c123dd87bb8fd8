"""The OPC UA server of a whole running gateway, read by asyncua's client; nothing in it can be written."""

import asyncio
import contextlib
import socket
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from gateway.profiles import ProfileError, load_rig, shipped_profiles_folder
from gateway.telemetry.opcua_process import NAMESPACE, GatewayNodes
from gateway.telemetry.sparkplug_metrics import NODE_METRICS
from gateway.telemetry.sparkplug_payload import DataType
from tests.end_to_end.conftest import start, stop

DEMO = shipped_profiles_folder() / "rigs" / "demo.yaml"


def rig_with(folder: Path, listen: str) -> str:
    file = folder / "rig.yaml"
    file.write_text(f'{DEMO.read_text(encoding="utf-8")}opcua: {{listen: "{listen}"}}\n', encoding="utf-8")
    return str(file)


def test_a_port_that_no_client_could_know_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ProfileError, match=r"opcua\.listen"):
        load_rig(rig_with(tmp_path, "127.0.0.1:0"))
    opcua = load_rig(rig_with(tmp_path, "127.0.0.1:4840")).opcua
    assert opcua and opcua.listen == "127.0.0.1:4840"


@pytest.mark.parametrize(
    ("value", "is_there", "status"),
    [(12.5, True, "Good"), (0.0, True, "Good"), (None, True, "BadNoData"), (None, False, "BadNoCommunication")],
)
def test_a_value_that_is_not_known_is_not_good(value: float | None, is_there: bool, status: str) -> None:
    ua = pytest.importorskip("asyncua").ua
    told = GatewayNodes(ua, None)._data_value(DataType.DOUBLE, value, datetime.now(UTC), is_there=is_there)
    assert told.StatusCode.name == status
    assert told.Value.Value == (value or 0.0)


@pytest.fixture
def endpoint(tmp_path: Path) -> Iterator[str]:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        listen = f"127.0.0.1:{probe.getsockname()[1]}"
    gateway = start(tmp_path / "state", "--sim", rig=rig_with(tmp_path, listen))
    yield f"opc.tcp://{listen}/"
    stop(gateway)


async def connected(endpoint: str, user: str) -> Any:
    from asyncua import Client

    async with asyncio.timeout(30):
        while True:
            client = Client(endpoint)
            if user:
                client.set_user(user)
                client.set_password("any")
            with contextlib.suppress(OSError):
                await client.connect()
                return client
            await asyncio.sleep(0.1)


@pytest.mark.long
@pytest.mark.parametrize("user", ["", "admin"])
def test_a_client_reads_every_figure_and_can_write_none(endpoint: str, user: str) -> None:
    from asyncua import ua

    async def scene() -> None:
        client = await connected(endpoint, user)
        try:
            place = await client.get_namespace_index(NAMESPACE)
            nodes = {one.name: client.get_node(f"ns={place};s=demo/{one.name}") for one in NODE_METRICS}
            values = {name: await node.read_value() for name, node in nodes.items()}
            assert (values["State"], values["Mode"], values["Properties/Rig"]) == ("off", "force", "demo")
            assert abs(values["Force/Measured N"]) < 5.0 and values["Control/Answers"] is True
            seen = {values["Force/Measured N"]}
            async with asyncio.timeout(10):
                while len(seen) < 3:
                    seen.add(await nodes["Force/Measured N"].read_value())
                    await asyncio.sleep(0.05)
            for name in ("Force/Requested N", "State"):
                with pytest.raises(ua.UaStatusCodeError):
                    await nodes[name].write_value(values[name])
            with pytest.raises(ua.UaStatusCodeError):
                await client.nodes.objects.add_object(place, "mine")
            with pytest.raises(ua.UaStatusCodeError):
                await client.delete_nodes([nodes["State"]])
            assert await nodes["State"].read_value() == "off"
        finally:
            await client.disconnect()

    asyncio.run(scene())
