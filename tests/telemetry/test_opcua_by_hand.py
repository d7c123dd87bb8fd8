"""The OPC UA process with its library's server played: what each variable says, how often, and who is cut."""

import asyncio
from types import SimpleNamespace
from typing import Any
from unittest.mock import AsyncMock

import pytest

from gateway.fieldbus.settings import ServerSettings
from gateway.live.control_link import ControlLink
from gateway.telemetry import opcua_process
from gateway.telemetry.opcua_connections import _judge, bound_connections, bound_publishing
from gateway.telemetry.opcua_process import GatewayNodes
from gateway.telemetry.sparkplug_metrics import ANSWERS, NODE_METRICS
from gateway.telemetry.sparkplug_payload import DataType
from tests.telemetry.readings import holding

_TYPES = {DataType.UINT64: "UInt64", DataType.DOUBLE: "Double", DataType.BOOLEAN: "Boolean", DataType.STRING: "String"}


@pytest.fixture(scope="module", autouse=True)
def ua() -> Any:
    """Not at the file's import: all workers would read this library."""
    return pytest.importorskip("asyncua").ua


def shown(ua: Any, *states: Any) -> dict[str, Any]:
    """What stands in each variable behind the last of these."""
    stands: dict[str, Any] = {}

    async def write(node: str, value: Any) -> None:
        stands[node] = value

    nodes = GatewayNodes(ua, SimpleNamespace(write_attribute_value=write))
    nodes._nodes = {metric.name: SimpleNamespace(nodeid=metric.name) for metric in NODE_METRICS}
    for state in states:
        asyncio.run(nodes.show(state))
    return stands


def test_each_variable_has_its_type_its_time_and_where_control_is_silent_no_value(ua: Any) -> None:
    there, gone = shown(ua, holding()), shown(ua, holding(), None)
    for metric in NODE_METRICS:
        for told in (there[metric.name], gone[metric.name]):
            assert told.Value.VariantType.name == _TYPES[metric.datatype], metric.name
            assert told.SourceTimestamp is not None
        if metric.name != ANSWERS:
            assert gone[metric.name].StatusCode.name == "BadNoCommunication", metric.name
            assert there[metric.name].StatusCode.name in ("Good", "BadNoData"), metric.name
    assert gone[ANSWERS].Value.Value is False and gone[ANSWERS].StatusCode.name == "Good"
    assert there["Force/Measured N"].Value.Value == 11.5


@pytest.mark.parametrize("error", [OSError("gone"), ValueError("busy")])
def test_a_control_that_does_not_answer_or_refuses_is_silent(error: Exception) -> None:
    async def ask(_request: dict[str, Any]) -> None:
        raise error

    assert asyncio.run(opcua_process._look(SimpleNamespace(ask=ask))) is None  # type: ignore[arg-type]


def test_it_looks_five_times_a_second_however_long_a_look_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    slept, now_s = list[float](), [0.0]

    async def sleep(pause_s: float) -> None:
        slept.append(pause_s)
        if len(slept) == 2:
            raise asyncio.CancelledError

    async def look(_link: object) -> None:
        now_s[0] += 0.05 if not slept else 0.5

    async def show(_state: object) -> None: ...

    monkeypatch.setattr(opcua_process, "asyncio", SimpleNamespace(sleep=sleep))
    monkeypatch.setattr(opcua_process, "time", SimpleNamespace(monotonic=lambda: now_s[0]))
    monkeypatch.setattr(opcua_process, "_look", look)
    with pytest.raises(asyncio.CancelledError):
        asyncio.run(opcua_process._show_forever(SimpleNamespace(show=show), None))  # type: ignore[arg-type]
    assert slept == [pytest.approx(0.15), 0.0]


@pytest.mark.parametrize("is_taken", [True, False])
def test_a_port_that_is_taken_is_told_or_that_it_serves_and_all_is_bounded_and_filled(
    is_taken: bool, ua: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    did = list[Any]()

    class Server:
        iserver = SimpleNamespace(subscription_service="subscriptions")

        async def init(self) -> None: ...
        def set_endpoint(self, place: str) -> None:
            did.append(place)

        def set_server_name(self, _name: str) -> None: ...
        def set_security_policy(self, policies: list[Any]) -> None:
            did.append([policy.name for policy in policies])

        def allow_remote_admin(self, allow: bool) -> None:
            did.append(("admin", allow))

        async def __aenter__(self) -> None:
            did.append("serves")
            if is_taken:
                raise OSError(98, "Address already in use")

        async def __aexit__(self, *_: object) -> None: ...

    class Nodes:
        def __init__(self, *_: object) -> None: ...
        async def add(self, rig: str) -> None:
            did.append(rig)

        async def show(self, state: object) -> None:
            did.append(state)

    monkeypatch.setattr(opcua_process, "import_library", lambda _name: SimpleNamespace(ua=ua, Server=Server))
    monkeypatch.setattr(opcua_process, "bound_connections", lambda wire, log: did.append(wire.__name__))
    monkeypatch.setattr(opcua_process, "bound_publishing", lambda service, least_s: did.append((service, least_s)))
    monkeypatch.setattr(opcua_process, "GatewayNodes", Nodes)
    monkeypatch.setattr(opcua_process, "_show_forever", show_forever := AsyncMock())
    options = {"settings": {"name": "demo", "listen": "127.0.0.1:4840"}, "state": "/nowhere"}
    log: Any = lambda cause, sentence: did.append((cause, sentence))  # noqa: E731
    asyncio.run(opcua_process.serve(options, log))
    assert did == [
        "asyncua.server.binary_server_asyncio", ("subscriptions", 0.2), "opc.tcp://127.0.0.1:4840/", ["NoSecurity"],
        ("admin", False), "demo", None, "serves",
        ("start", "E127 opcua.listen: Address already in use" if is_taken else "OPC UA is served: opc.tcp://127.0.0.1:4840/"),
    ]  # fmt: skip
    given = [[type(each) for each in called.args] for called in show_forever.await_args_list]
    assert given == ([] if is_taken else [[Nodes, ControlLink]])


@pytest.mark.parametrize(
    ("wanted_ms", "given_ms"), [(1e-3, 200.0), (0.0, 200.0), (float("nan"), 200.0), (500.0, 500.0)]
)
def test_nobody_is_told_more_often_than_there_is_something_new(ua: Any, wanted_ms: float, given_ms: float) -> None:
    """By an interval of a microsecond a client without any right took a whole core."""
    from asyncua.server.subscription_service import SubscriptionService

    async def scene() -> float:
        service: Any = SubscriptionService(None)  # type: ignore[arg-type]
        bound_publishing(service, opcua_process.LOOK_S)
        wanted = ua.CreateSubscriptionParameters()
        wanted.RequestedPublishingInterval = wanted_ms
        made = await service.create_subscription(wanted, None, ua.NodeId())
        await service.delete_subscriptions([made.SubscriptionId])
        return float(made.RevisedPublishingInterval)

    assert asyncio.run(scene()) == given_ms


def test_who_was_refused_is_heard_no_more_and_who_has_gone_is_waited_for_no_more() -> None:
    heard, told = list[bytes](), list[str]()

    class Wire:
        _buffer = b""

        def connection_made(self, transport: Any) -> None:
            self.transport = transport

        def connection_lost(self, error: BaseException | None) -> None: ...
        def data_received(self, data: bytes) -> None:
            heard.append(data)

    wire = SimpleNamespace(OPCUAProtocol=Wire)
    bound_connections(wire, lambda cause, sentence: told.append(sentence), ServerSettings(connections=1))
    far: Any = SimpleNamespace(get_extra_info=lambda _: ("127.0.0.1", 5), close=lambda: None, abort=lambda: None)

    async def scene() -> None:
        first, second = wire.OPCUAProtocol(), wire.OPCUAProtocol()
        for protocol in (first, second):
            protocol.connection_made(far)
        first.data_received(b"HEL")
        second.data_received(b"no")
        timer = first._silence._timer
        first.connection_lost(None)
        assert timer.cancelled() and second._silence is None

    asyncio.run(scene())
    assert heard == [b"HEL"] and told[0].startswith("W230 127.0.0.1:5: 1 connections are open")
    left: Any = SimpleNamespace(get_extra_info=lambda _: None)
    assert "it has left already" in _judge(left, None)[1]  # type: ignore[arg-type]
