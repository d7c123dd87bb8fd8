"""Wiring and configuration: every value stands where the tab says, and secrets stay where they are."""

import os
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.live.control_link import ControlLink
from gateway.profiles import load_rig, shipped_profiles_folder
from gateway.web.context import WebContext
from gateway.web.register_table import register_table
from gateway.web.tabs.configuration import _configuration
from gateway.web.tabs.rig_values import HIDDEN, _row, rig_document
from gateway.web.tabs.wiring import wiring_document
from tests.web.tabs.served_tabs import serve

CONTROL = ("limits.", "defaults.", "trim.", "lead.", "supervision.", "self_test.")


@pytest.fixture
def own_rig(tmp_path: Path) -> Path:
    text = (shipped_profiles_folder() / "rigs" / "demo.yaml").read_text(encoding="utf-8")
    file = tmp_path / "own.yaml"
    file.write_text(text + 'web: {listen: "127.0.0.1:0", token: a-secret-of-this-rig}\n', encoding="utf-8")
    return file


def test_each_value_that_is_set_stands_in_its_line(own_rig) -> None:
    lines = own_rig.read_text(encoding="utf-8").splitlines()
    rig = rig_document(str(own_rig), simulated=True)["files"][0]
    set_values = [one for one in rig["values"] if one["line"] is not None]
    assert len(set_values) > 30
    for one in set_values:
        assert one["path"].rpartition(".")[2] in lines[one["line"] - 1], one
    by_path = {one["path"]: one for one in rig["values"]}
    assert (by_path["load_cell.sign"]["value"], by_path["load_cell.sign"]["default"]) == ("1", "1")
    assert by_path["network.idle_s"]["line"] is None  # nobody has written it


def test_each_number_of_control_says_what_it_is(own_rig) -> None:
    """Of eighteen, the safe voltage and what ends a force among them, a page or an editor said nothing."""
    values = rig_document(str(own_rig), simulated=True)["files"][0]["values"]
    told = {one["path"]: one["about"] for one in values if one["path"].startswith(CONTROL)}
    assert len(told) > 30
    assert [path for path, about in told.items() if not about or "None" in about] == []


def test_every_file_of_the_rig_is_told_with_a_numbers_source(own_rig) -> None:
    files = {Path(one["file"]).name: one["values"] for one in rig_document(str(own_rig), simulated=True)["files"]}
    assert {"own.yaml", "force-v1.yaml", "smc-itv-rc.yaml", "stream-st-gs.yaml", "paper-slide.yaml"} <= files.keys()
    steps = {one["path"]: one for one in files["paper-slide.yaml"]}
    assert "computed" in steps["regulator.command_step_v"]["about"]
    assert steps["regulator.command_step_v"]["unit"] == "V"


def test_a_token_is_not_shown(own_rig, state) -> None:
    values = {one["path"]: one["value"] for one in rig_document(str(own_rig), simulated=True)["files"][0]["values"]}
    assert values["web.token"] == HIDDEN
    with serve(state, str(own_rig)) as page:
        assert b"a-secret-of-this-rig" not in page.get("/api/v1/configuration").body


def test_a_rig_file_that_has_become_faulty_is_told_in_words(own_rig, state) -> None:
    with serve(state, str(own_rig)) as page:
        own_rig.write_text("name: [", encoding="utf-8")
        for path in ("configuration", "wiring"):
            answer = page.get(f"/api/v1/{path}")
            assert answer.status == 409
            assert "own.yaml" in answer.json["error"]


def test_a_rig_file_whose_name_is_no_utf_8_is_shown_and_its_faults_told(own_rig, state) -> None:
    """As an older system wrote it. Both tabs were an internal error."""
    file = own_rig.rename(own_rig.with_name(os.fsdecode(b"caf\xe9.yaml")))
    with serve(state, str(file)) as page:
        for path in ("configuration", "wiring"):
            assert page.get(f"/api/v1/{path}").status == 200
        file.write_text("name: [", encoding="utf-8")
        assert "caf" in page.get("/api/v1/configuration").json["error"]


def test_files_that_have_changed_since_the_start_are_not_shown_as_what_runs(own_rig, state) -> None:
    """A limit that was edited stood there as if it were in use."""
    started = load_rig(str(own_rig), simulated=True).fingerprint
    context = WebContext(state, str(own_rig), True, ControlLink(state), started)
    assert not wiring_document(context)["other"]
    assert not any("W247" in each for each in _configuration(context)["warnings"])
    own_rig.write_text(
        own_rig.read_text(encoding="utf-8").replace("force_max_n: 60", "force_max_n: 20"), encoding="utf-8"
    )
    assert "in use from the next start on" in wiring_document(context)["other"]
    assert "W247" in _configuration(context)["warnings"][0]


def test_the_wiring_of_a_gateway_that_listens_elsewhere_says_where(page, control, state) -> None:
    """Under `run --bind` its mbpoll lines and a robot's settings named the port of the file, without a word."""
    answer = control.answer
    for port, told in (
        (15020, "Modbus TCP is on port 15020 now, where the lines below say 5020"),
        (5020, ""),
        (None, ""),
    ):
        control.answer = lambda asked, port=port: {"port": port} if asked["do"] == "running" else answer(asked)
        other = page.get("/api/v1/wiring").json["other"]
        assert told in other and bool(other) is bool(told), other


def test_the_wiring_is_that_of_the_verb(page) -> None:
    answer = page.get("/api/v1/wiring").json
    assert answer["title"].startswith("Wiring of rig demo")
    assert any("mbpoll" in line for one in answer["sections"] for line in one["commands"])


@pytest.mark.parametrize("name", ["token", "password", "broker_password", "key"])
def test_no_value_is_shown_that_opens_something(name: str) -> None:
    document: Any = SimpleNamespace(marks={})
    assert _row(("mqtt", name), "s3cret", document)["value"] == HIDDEN
    assert _row(("mqtt", name), "", document)["value"] != HIDDEN, "where none is set that is said"


@pytest.mark.parametrize(("bind", "host"), [("0.0.0.0", ""), ("::", ""), ("192.168.1.7", "192.168.1.7")])
def test_who_listens_on_every_address_is_reached_where_the_page_is(bind: str, host: str) -> None:
    rig = load_rig("demo", simulated=True)
    assert register_table(replace(rig, network=replace(rig.network, bind=bind)), 5020)["host"] == host
