"""Calibrations and plants on the page: what is listed, used and compared is what the stores and the verbs say."""

import json
from dataclasses import replace

import pytest

from gateway.calibrations.store import CalibrationStore
from gateway.numbered_documents.store import NumberedStore
from gateway.plants.store import NumberedPlant, PlantStore, Provenance
from gateway.profiles import load_calibration, load_plant
from gateway.twin.plant import with_value


def add_calibration(state, **changes) -> int:
    built_in = load_calibration("demo")
    return CalibrationStore(state, built_in).add(replace(built_in, name="second", **changes))


def add_plant(state) -> int:
    profile = load_plant("paper-slide")
    profile = replace(profile, plant=with_value(profile.plant, "friction", "coulomb_n", 1.5))
    provenance = Provenance(
        made_utc="2026-11-22T17:30:00Z", version="0", rig="demo", start="paper-slide", file="p.yaml"
    )
    return PlantStore(state).add(NumberedPlant(number=0, profile=profile, provenance=provenance))


def in_use(store: NumberedStore) -> int | None:
    return store.find_selected().selection.number


def test_the_list_has_the_rigs_own_the_stored_ones_and_the_damaged_ones(page, state) -> None:
    number = add_calibration(state, rejected="0.9 N RMS, allowed 0.5")
    damaged = add_calibration(state)
    (state / "calibrations" / f"{damaged:04d}.yaml").write_text("nothing")
    answer = page.get("/api/v1/calibrations").json
    broken, stored, own = answer["calibrations"]
    assert "calibrations/" in broken["fault"]
    assert (stored["number"], stored["active"], stored["rejected"]) == (number, False, "0.9 N RMS, allowed 0.5")
    assert (own["is_own"], own["active"], own["has_report"]) == (True, True, False)
    assert answer["can_go_back"] is False


@pytest.mark.parametrize("noun", ["calibrations", "plants"])
def test_one_of_each_list_is_in_use_and_it_is_the_one_that_the_store_says(page, state, noun) -> None:
    number = add_calibration(state) if noun == "calibrations" else add_plant(state)
    store = CalibrationStore(state, load_calibration("demo")) if noun == "calibrations" else PlantStore(state)
    assert [row["active"] for row in page.get(f"/api/v1/{noun}").json[noun]] == [False, True], "the rig's own"
    store.use(number)
    answer = page.get(f"/api/v1/{noun}").json
    assert [(row["number"], row["is_own"]) for row in answer[noun] if row["active"]] == [(number, False)]
    assert answer["can_go_back"] is True and [row["fault"] for row in answer[noun]] == ["", ""]


def test_use_and_back_change_what_is_in_use_and_a_rejected_one_is_asked_for_twice(page, state) -> None:
    number = add_calibration(state, rejected="0.9 N RMS, allowed 0.5")
    refused = page.post("/api/v1/calibrations/change", {"use": number})
    assert refused.status == 409
    assert "0.9 N RMS" in refused.json["error"]
    assert in_use(CalibrationStore(state)) is None
    used = page.post("/api/v1/calibrations/change", {"use": number, "force": True})
    assert f"calibration {number}" in used.json["said"]
    assert in_use(CalibrationStore(state)) == number
    assert page.get("/api/v1/calibrations").json["can_go_back"] is True
    assert page.post("/api/v1/calibrations/change", {"back": True}).status == 200
    assert in_use(CalibrationStore(state)) is None


@pytest.mark.parametrize("body", [{}, {"use": 1, "back": True}, {"use": "1"}, {"use": 1.5}, {"use": -1}])
def test_a_change_says_one_thing(page, body) -> None:
    assert page.post("/api/v1/calibrations/change", body).status == 400


@pytest.mark.long
def test_plants_are_listed_previewed_compared_and_used(page, state) -> None:
    number = add_plant(state)
    stored, own = page.get("/api/v1/plants").json["plants"]
    assert (stored["number"], stored["from"], own["number"], own["active"]) == (number, "p.yaml", 0, True)
    assert "compensated" in page.get(f"/api/v1/plants/{number}/preview").json
    assert list(page.get(f"/api/v1/plants/compare?a=0&b={number}").json["differing"]) == ["friction.coulomb_n"]
    assert f"plant {number}" in page.post("/api/v1/plants/change", {"use": number}).json["said"]
    assert in_use(PlantStore(state)) == number


@pytest.mark.long
def test_two_calibrations_side_by_side_are_a_page_that_runs_nothing(page, state) -> None:
    number = add_calibration(state)
    answer = page.get(f"/api/v1/calibrations/compare?a=1&b={number}")
    assert answer.status == 200
    assert b"<svg" in answer.body
    assert "sandbox" in answer.headers["content-security-policy"]


def test_a_report_is_shown_only_beside_its_own_document(page, state) -> None:
    folder = state / "calibrations"
    folder.mkdir()
    (folder / "0003.html").write_text("<!doctype html>three")
    (folder / "0003.json").write_text(json.dumps({"calibration": 3}))
    assert page.get("/api/v1/calibrations/3/report").body == b"<!doctype html>three"
    (folder / "0003.json").write_text(json.dumps({"calibration": 4}))
    assert page.get("/api/v1/calibrations/3/report").status == 404
