"""Which children a rig asks for beside control, what each is told, and where their sockets listen."""

import socket
from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.processes import exit_codes
from gateway.profiles import Rig
from gateway.profiles.http_sections import Metrics, OpcUa, Web
from gateway.profiles.rigs import rig as rig_module
from gateway.profiles.rigs.rig_file import ResidualWatch
from gateway.profiles.telemetry_sections import Mqtt
from gateway.service import optional_children as room
from gateway.service.optional_children import Listeners, optional_children
from gateway.service.running_rig.starting import StartError
from tests.service.rigs import demo

RING: Any = object()


@pytest.fixture
def listeners() -> Iterator[Listeners]:
    one = Listeners({})
    yield one
    one.close()


def watched(**changes: Any) -> Rig:
    return replace(demo(), residual_watch=ResidualWatch(window_s=90.0, every_s=15.0), **changes)


def test_each_child_is_told_what_it_needs_and_no_secret() -> None:
    rig = watched(
        mqtt=Mqtt(host="broker", username="me"),
        opcua=OpcUa(listen="127.0.0.1:4840"),
        web=Web(listen="127.0.0.1:8080", token="a-secret-of-some-length"),
    )
    told = optional_children(rig, RING, {"web": ("127.0.0.1", 8080), "metrics": ("::1", 9090)})
    again = {"simulated": True, "fingerprint": rig.fingerprint}
    assert told == {
        "watch": again | {"window_s": 90.0, "every_s": 15.0},
        "mqtt": again,
        "opcua": {"settings": {"listen": "127.0.0.1:4840", "name": "demo"}},
        "web": again | {"settings": {"host": "127.0.0.1", "port": 8080}},
        "metrics": again | {"settings": {"host": "::1", "port": 9090}},
    }
    assert "secret" not in str(told)


def test_a_rig_that_asks_for_nothing_gets_nothing() -> None:
    bare = replace(demo(), residual_watch=ResidualWatch(enabled=False))
    assert optional_children(bare, RING, {}) == {}


def test_without_its_library_or_a_ring_to_look_at_no_watch_is_started(monkeypatch: pytest.MonkeyPatch) -> None:
    assert "watch" in optional_children(watched(), RING, {})
    assert "watch" not in optional_children(watched(), None, {})
    monkeypatch.setattr(rig_module, "is_installed", lambda name: False)
    assert "watch" not in optional_children(watched(), RING, {})


def test_the_rigs_own_address_is_opened_where_the_command_line_names_none(listeners: Listeners) -> None:
    rig = replace(demo(), metrics=Metrics(listen="127.0.0.1:0"), web=Web(listen="127.0.0.1:0"))
    assert listeners.open(rig, {}) == ()
    assert set(listeners.addresses) == {"web", "metrics"}
    for name, (host, port) in listeners.addresses.items():
        assert listeners.sockets[name].getsockname() == (host, port)
        socket.create_connection((host, port), timeout=5.0).close()
    listeners.close()
    assert all(one.fileno() == -1 for one in listeners.sockets.values())


def test_a_page_that_is_kept_does_not_keep_the_metrics_from_opening() -> None:
    one = Listeners({"web": ["127.0.0.1", 8080]})
    one.open(demo(), {"web": ["127.0.0.1", 8080], "metrics": ["127.0.0.1", 0]})
    assert set(one.sockets) == {"metrics"} and one.addresses["web"] == ("127.0.0.1", 8080)
    one.close()


def test_metrics_are_read_only_and_need_no_token_anywhere(listeners: Listeners) -> None:
    listeners.open(demo(), {"metrics": ["0.0.0.0", 0]})
    assert listeners.addresses["metrics"][0] == "0.0.0.0"


def test_a_section_without_a_token_is_no_token(listeners: Listeners) -> None:
    with pytest.raises(StartError, match="E128"):
        listeners.open(replace(demo(), web=Web()), {"web": ["0.0.0.0", 0]})
    assert listeners.sockets == {}


def test_a_page_with_a_token_may_be_reached_from_elsewhere(listeners: Listeners) -> None:
    rig = replace(demo(), web=Web(listen="0.0.0.0:0", token="a-secret-of-some-length"))
    listeners.open(rig, {})
    assert listeners.addresses["web"][0] == "0.0.0.0"


@pytest.mark.skipif(not socket.has_ipv6, reason="no IPv6 here")
def test_an_address_of_ipv6_is_opened_as_one(listeners: Listeners) -> None:
    try:
        socket.create_server(("::1", 0), family=socket.AF_INET6).close()
    except OSError:
        pytest.skip("no IPv6 loopback here")
    listeners.open(demo(), {"web": ["::1", 0]})
    assert listeners.sockets["web"].family is socket.AF_INET6


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (PermissionError(13, "denied"), exit_codes.PERMISSION),
        (OSError(99, "no such address"), exit_codes.DEVICE),
        (OSError("it says nothing"), exit_codes.DEVICE),
    ],
)
def test_who_may_not_listen_there_is_told_apart_from_who_cannot(
    error: OSError, code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr(room, "socket", SimpleNamespace(create_server=refuse, AF_INET=2, AF_INET6=10))
    with pytest.raises(StartError) as ended:
        Listeners({}).open(demo(), {"web": ["127.0.0.1", 80]})
    assert ended.value.exit_code == code
    assert "E127 --web 127.0.0.1:80: " in str(ended.value)
    assert "None" not in str(ended.value)
