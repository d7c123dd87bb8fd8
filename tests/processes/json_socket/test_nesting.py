"""Whatever others send as JSON is refused before its reader recurses so deep that a collection of garbage in there has no room:
what a lost connection has left could not be closed."""

import asyncio
import gc
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from gateway.processes.json_socket.messages import load_shallow
from gateway.processes.json_socket.server import JsonLineServer
from gateway.profiles import load_register_map
from gateway.telemetry.mqtt.register_commands import RegisterCommands
from tests.web.asgi import call, page

NEEDED = 500
"""Calls inside of each other: more than any finalizer makes, and half of what there may be."""
EVERY = 20
"""Of so many new lists one begins a collection."""


def by_socket(payload: bytes, folder: Path) -> object:
    return JsonLineServer(folder / "a.sock", {}, lambda kind, text: None).answer(payload)


def by_mqtt(payload: bytes, folder: Path) -> object:
    commands = RegisterCommands(load_register_map("force-v1"), None, 1)  # type: ignore[arg-type]
    return asyncio.run(commands.carry_out(payload))


def by_page(payload: bytes, folder: Path) -> object:
    return _post("/api/v1/command/enable", payload, folder)


def by_tab(payload: bytes, folder: Path) -> object:
    return _post("/api/v1/diagnosis/begin", payload, folder)


def _post(path: str, payload: bytes, folder: Path) -> object:
    app = page(folder)
    opened = asyncio.run(call(app, "GET", "/api/v1/session"))
    session = {"cookie": opened.cookie, "x-csrf-token": opened.json["csrf"]}
    answer = asyncio.run(call(app, "POST", path, session, payload))
    assert answer.status == 400
    return answer


def _dive(calls: int) -> int:
    return _dive(calls - 1) if calls else 0


@contextmanager
def rooms_noted() -> Iterator[list[bool]]:
    """Collect garbage again and again; note each time whether what is called then has room."""
    rooms, was = list[bool](), gc.get_threshold()

    def note(phase: str, _: dict[str, int]) -> None:
        if phase == "start":
            try:
                _dive(NEEDED)
                rooms.append(True)
            except RecursionError:
                rooms.append(False)

    gc.callbacks.append(note)
    gc.set_threshold(EVERY)
    try:
        yield rooms
    finally:
        gc.set_threshold(*was)
        gc.callbacks.remove(note)


@pytest.mark.parametrize("ask", [by_socket, by_mqtt, by_page, by_tab])
def test_garbage_that_is_collected_while_nested_json_is_read_has_room(
    ask: Callable[[bytes, Path], object], tmp_path: Path
) -> None:
    payload = b'{"do": ' + b"[" * 700 + b"]" * 700 + b"}"
    ask(payload, tmp_path)  # what is imported and made with the first one
    with rooms_noted() as rooms:
        ask(payload, tmp_path)
    assert rooms and all(rooms)


DEEP = b"[" * 101 + b"]" * 101


@pytest.mark.parametrize("text", [DEEP, b'{"a":' * 101, b"[" * 60_000, DEEP.decode().encode("utf-16")])
def test_what_is_nested_deeper_than_any_request_is_refused(text: bytes) -> None:
    with pytest.raises(ValueError, match="nested more than 100 deep"):
        load_shallow(text)


@pytest.mark.parametrize(
    "value", [[[]] * 500, "[" * 500, '"' + "[" * 500, "\\", {'\\"' + "{" * 500: "[" * 500 + '\\"'}, {"a": ["é[", 1.5]}]
)
def test_what_is_long_and_not_deep_is_read(value: Any) -> None:
    assert load_shallow(json.dumps(value).encode()) == value
    assert load_shallow(json.dumps(value, ensure_ascii=False).encode("utf-16")) == value


@pytest.mark.parametrize("text", [b"", b"[", b'"', b'"\\', b'{"a": "[}', b"\xff\xfe{", b"]" * 500, b'"' * 501])
def test_what_is_no_json_is_told_as_it_was(text: bytes) -> None:
    with pytest.raises(ValueError) as told:
        load_shallow(text)
    assert "nested" not in str(told.value)
