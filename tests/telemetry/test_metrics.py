"""What Prometheus reads: one table for both ways, base units, no old values, and dashboards that ask for what there is."""

import asyncio
import json
import os
import re
import socket
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.parser import text_string_to_metric_families as parse
from starlette.applications import Starlette

from gateway.processes.json_socket.server import JsonLineServer
from gateway.telemetry import metrics_process
from gateway.telemetry.exposition import exposition
from gateway.telemetry.metrics_process import ReadingCollector, make_metrics_app, read_gateway
from gateway.telemetry.series import SERIES, GatewayReading
from gateway.web.bounded_http import BoundedHttpProtocol
from tests.telemetry.readings import HEALTH, holding, reading, without_sample
from tests.web.asgi import call

Samples = dict[tuple[str, frozenset[tuple[str, str]]], float]


def samples(text: str) -> Samples:
    found = [sample for family in parse(text) for sample in family.samples]
    return {(one.name, frozenset(one.labels.items())): one.value for one in found}


def scrape(app: Starlette) -> Samples:
    answer = asyncio.run(call(app, "GET", "/metrics"))
    assert answer.status == 200 and answer.headers["content-type"].startswith("text/plain")
    return samples(answer.body.decode())


def test_a_scraper_that_asks_for_a_version_that_is_none_reads_the_usual_text(tmp_path: Path) -> None:
    asked = {"accept": "application/openmetrics-text;version=zz"}
    answer = asyncio.run(call(make_metrics_app(tmp_path), "GET", "/metrics", asked))
    assert answer.status == 200 and answer.headers["content-type"].startswith("text/plain")


def test_a_scraper_that_asks_for_open_metrics_reads_them_to_their_mark_of_an_end(tmp_path: Path) -> None:
    asked = {"accept": "application/openmetrics-text;version=1.0.0"}
    answer = asyncio.run(call(make_metrics_app(tmp_path), "GET", "/metrics", asked))
    assert answer.headers["content-type"].startswith("application/openmetrics-text; version=1.0.0")
    assert answer.body.decode().endswith("\nforce_gateway_up 0.0\n# EOF\n")


def test_both_ways_tell_the_same_and_an_absent_control_leaves_nothing_but_down(tmp_path: Path) -> None:
    health = HEALTH | {"residual": {"cause": 0, "name": "none", "looks": 4}}

    async def scene() -> None:
        control = JsonLineServer(
            tmp_path / "control.sock", {"state": lambda _: holding().to_json(), "health": lambda _: dict(health)}
        )
        await control.start()
        app = make_metrics_app(tmp_path)
        answer = await call(app, "GET", "/metrics")
        assert samples(answer.body.decode()) == samples("\n".join(exposition(reading())) + "\n")
        await control.close()
        down = await call(app, "GET", "/metrics")
        assert samples(down.body.decode()) == {("force_gateway_up", frozenset()): 0.0}

    asyncio.run(scene())


def test_without_a_gateway_the_scrape_says_down(tmp_path: Path) -> None:
    assert scrape(make_metrics_app(tmp_path)) == {("force_gateway_up", frozenset()): 0.0}


@pytest.mark.parametrize(
    ("name", "labels", "value"),
    [
        ("force_newtons", {}, 11.5),
        ("force_error_newtons", {}, 0.5),
        ("pressure_pascals", {}, 200_000.0),
        ("state", {"state": "holding"}, 1.0),
        ("state", {"state": "fault"}, 0.0),
        ("warning", {"code": "W301", "title": 'a "quoted" title'}, 1.0),
        ("serial_frames_total", {"line": "output", "kind": "asked"}, 20.0),
        ("serial_errors_total", {"line": "load_cell"}, 0.0),
        ("loop_late_p99_seconds", {}, 0.001024),
        ("calibration_age_seconds", {}, 60.0),
        ("refusals_total", {}, 2.0),
    ],
)
def test_a_series_has_its_value_in_base_units(name: str, labels: dict[str, str], value: float) -> None:
    found = samples("\n".join(exposition(reading())) + "\n")
    assert found["force_gateway_" + name, frozenset(labels.items())] == pytest.approx(value)


def test_the_error_of_a_pull_is_that_of_the_push_it_mirrors() -> None:
    """Its setpoint is positive, and what the cell measures is negative."""
    state = holding()
    pull = replace(state, status=("enabled", "pulling"), force=replace(state.force, measured_n=-11.5))
    found = samples("\n".join(exposition(GatewayReading(pull, HEALTH))) + "\n")
    assert found["force_gateway_force_newtons", frozenset()] == -11.5
    assert found["force_gateway_force_error_newtons", frozenset()] == pytest.approx(0.5)


def test_a_force_that_is_not_measured_is_left_out() -> None:
    names = {name for name, _ in samples("\n".join(exposition(without_sample())) + "\n")}
    assert not names & {"force_gateway_force_newtons", "force_gateway_force_error_newtons"}
    assert "force_gateway_setpoint_applied_newtons" in names


def test_names_follow_the_custom() -> None:
    names = [series.name for series in SERIES]
    assert len(names) == len(set(names))
    assert all((series.kind == "counter") == series.name.endswith("_total") for series in SERIES)
    endings = {"N": "newtons", "V": "volts", "s": "seconds", "Pa": "pascals", "": ""}
    for series in SERIES:
        assert series.name.removesuffix("_total").endswith(endings[series.unit]), series.name


@pytest.mark.parametrize("file", ["grafana.json", "telegraf.conf"])
def test_a_shipped_file_asks_only_for_what_there_is(file: str) -> None:
    text = (files("gateway.telemetry") / "dashboards" / file).read_text(encoding="utf-8")
    named = set(re.findall(r"\bforce_gateway_\w+", text))
    assert len(named) > 15
    assert named <= {series.name for series in SERIES}


def test_the_dashboard_is_one_that_grafana_can_import() -> None:
    board = json.loads((files("gateway.telemetry") / "dashboards" / "grafana.json").read_text(encoding="utf-8"))
    places = [tuple(panel["gridPos"].values()) for panel in board["panels"]]
    assert len(set(places)) == len(places) and board["schemaVersion"] >= 36
    assert all(panel["targets"] for panel in board["panels"])


def test_the_dashboard_draws_nothing_in_another_unit_than_it_has() -> None:
    """The number of a cause stood among newtons: 99 N, and the residual a line at 0 below it."""
    drawn = {"N": "forceN", "V": "volt", "s": "s", "": "short"}
    units = {series.name: drawn.get(series.unit) for series in SERIES}
    board = json.loads((files("gateway.telemetry") / "dashboards" / "grafana.json").read_text(encoding="utf-8"))
    for panel in board["panels"]:
        fields = panel["fieldConfig"]
        own = {one["matcher"]["options"]: one["properties"][0]["value"] for one in fields["overrides"]}
        for target in panel["targets"]:
            named = re.fullmatch(r"-?(force_gateway_\w+)\{[^}]*\}( == 1)?", target["expr"])
            if named:  # no rate, which has a unit of its own
                shown = own.get(target["refId"], fields["defaults"]["unit"])
                assert shown.replace("none", "short") == units[named[1]], target["expr"]


def test_a_control_that_refuses_to_say_is_one_that_does_not_answer() -> None:
    class Refusing:
        async def ask(self, request: dict[str, Any]) -> dict[str, Any]:
            raise ValueError("too many questions")

    assert asyncio.run(read_gateway(Refusing())) is None  # type: ignore[arg-type]


def test_what_the_watch_has_found_is_told_by_number_and_name_and_nothing_where_no_watch_speaks() -> None:
    told = {"cause": 12, "name": "coulomb-friction", "rms_n": 0.3, "age_s": None}
    found = samples("\n".join(exposition(replace(reading(), health=HEALTH | {"residual": told}))) + "\n")
    residual = {key: value for key, value in found.items() if "residual" in key[0] and "model" not in key[0]}
    assert residual == {
        ("force_gateway_residual_cause", frozenset({("name", "coulomb-friction")})): 12.0,
        ("force_gateway_residual_rms_newtons", frozenset()): 0.3,
    }
    for nothing in ({}, {"residual": None}):
        health = {key: value for key, value in HEALTH.items() if key != "residual"} | nothing
        names = {name for name, _ in samples("\n".join(exposition(replace(reading(), health=health))) + "\n")}
        assert not any("residual_cause" in name for name in names)


def test_a_pressure_that_no_device_reports_is_left_out() -> None:
    state = reading().state
    silent = replace(reading(), state=replace(state, force=replace(state.force, pressure_kpa=None)))
    assert "pressure_pascals" not in "\n".join(exposition(silent))


def test_a_counter_has_one_ending_and_nobody_keeps_what_was_read(tmp_path: Path) -> None:
    collector = ReadingCollector(reading())
    registry = CollectorRegistry(auto_describe=False)
    registry.register(collector)
    text = generate_latest(registry).decode()
    assert "# TYPE force_gateway_" in text and "_total_total" not in text
    answer = asyncio.run(call(make_metrics_app(tmp_path), "GET", "/metrics"))
    assert answer.headers["cache-control"] == "no-store"


def test_scrapers_are_bounded_like_any_client(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    given = dict[str, Any]()

    class Server:
        def __init__(self, config: object) -> None: ...
        async def serve(self, sockets: list[Any]) -> None:
            sockets[0].close()

    monkeypatch.setattr("uvicorn.Config", lambda app, **options: given.update(options))
    monkeypatch.setattr("uvicorn.Server", Server)
    with socket.socket() as listening:
        options = {"state": str(tmp_path), "listen": os.dup(listening.fileno())}
        asyncio.run(metrics_process.serve(options, None))  # type: ignore[arg-type]
    assert (given["limit_concurrency"], given["http"], given["server_header"]) == (32, BoundedHttpProtocol, False)
