"""Verbs that ask a running gateway by its socket: what they ask, and what they say of the answer."""

import json
import socket
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from gateway.live.live_state import LiveState


@pytest.fixture
def control_socket(tmp_path: Path) -> Iterator[Callable[[Any], list[Any]]]:
    """answering(*answers) serves a request for each on tmp_path/control.sock; the list holds what was asked."""
    listeners: list[tuple[socket.socket, threading.Thread]] = []

    def answering(*answers: Any) -> list[Any]:
        requests: list[Any] = []
        listener = socket.socket(socket.AF_UNIX)
        listener.bind(str(tmp_path / "control.sock"))
        listener.listen()

        def serve() -> None:
            for answer in answers:
                connection, _ = listener.accept()
                with connection, connection.makefile("rwb") as stream:
                    requests.append(json.loads(stream.readline()))
                    stream.write(json.dumps(answer).encode() + b"\n")

        listeners.append((listener, threading.Thread(target=serve)))
        listeners[-1][1].start()
        return requests

    yield answering
    for listener, thread in listeners:
        thread.join(10)
        listener.close()


@pytest.mark.parametrize(
    ("word", "request_", "answer", "sentence"),
    [
        ("on", {"do": "record", "on": True}, {"recording": "/s/0001.fgr", "rows": 0}, "recording to /s/0001.fgr"),
        (
            "off",
            {"do": "record", "on": False},
            {"recording": None, "written": "/s/1.fgr", "rows": 9},
            "recorded 9 rows",
        ),
        ("status", {"do": "record"}, {"recording": None}, "not recording"),
    ],
)
def test_record_asks_the_running_gateway(
    word: str, request_: Any, answer: Any, sentence: str, call, control_socket, tmp_path: Path
) -> None:
    requests = control_socket({"ok": True} | answer)
    result = call("record", word, "--state", tmp_path)
    assert result.exit_code == 0, result.output
    assert requests == [request_]
    assert sentence in result.output


def test_metrics_are_figures_with_a_name_a_kind_and_base_units(call, control_socket, tmp_path: Path) -> None:
    residual = {"cause": 1, "name": "transport-delay", "warnings": 2, "age_s": None, "rms_n": 0.31}
    health = {"ticks": 500, "missed_ticks": 3, "loop_time_us": 250.0, "late_p50_us": 64, "late_p99_us": 1024}
    state = LiveState(rig="demo", simulated=True, version="1", time_unix_s=0.0, state="off")
    requests = control_socket({"ok": True} | state.to_json(), {"ok": True, **health, "residual": residual})
    result = call("metrics", "--state", tmp_path)
    assert (result.exit_code, requests) == (0, [{"do": "state"}, {"do": "health"}])
    lines = result.output.splitlines()
    values = [line for line in lines if not line.startswith("#")]
    assert values[-8:] == [
        "force_gateway_loop_ticks_total 500",
        "force_gateway_loop_missed_ticks_total 3",
        "force_gateway_loop_step_seconds 0.00025",
        "force_gateway_loop_late_p50_seconds 6.4e-05",
        "force_gateway_loop_late_p99_seconds 0.001024",
        'force_gateway_residual_cause{name="transport-delay"} 1',
        "force_gateway_residual_warnings_total 2",
        "force_gateway_residual_rms_newtons 0.31",
    ]
    assert "# TYPE force_gateway_loop_ticks_total counter" in lines
    assert 'force_gateway_state{state="off"} 1' in values and "force_gateway_up 1" in values
    assert not any(line.startswith("force_gateway_force_newtons ") for line in values), "no sample, no figure"


def test_what_the_gateway_refuses_is_told(call, control_socket, tmp_path: Path) -> None:
    control_socket({"ok": False, "error": "already recording to 0001.fgr"})
    answer = call("record", "on", "--state", tmp_path)
    assert answer.exit_code == 1
    assert answer.stderr == "E141 already recording to 0001.fgr\n"


def test_without_a_gateway_record_ends_with_69(call, tmp_path: Path) -> None:
    answer = call("record", "on", "--state", tmp_path)
    assert answer.exit_code == 69
    assert answer.stderr.startswith("E140 ")
    assert "--state" in answer.stderr
