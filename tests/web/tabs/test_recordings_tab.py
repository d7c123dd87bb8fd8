"""Recordings on the page: what is listed, and that a download is the recording."""

import io
import tempfile
import time
from pathlib import Path

import numpy as np
import pytest

from gateway import extras
from gateway.recording import read_recording, read_table
from gateway.reports.recording_plot import _thinned
from tests.web.tabs.conftest import ROWS, record


def test_the_list_says_what_each_is_and_names_what_cannot_be_read(page, state) -> None:
    record(state)
    record(state, ladder={"groups": 3, "step_v": 0.5})
    (state / "recordings" / "0003.fgr").write_bytes(b"no recording")
    newest, ladder, run = page.get("/api/v1/recordings").json["recordings"]
    assert (run["number"], run["rows"]) == (1, ROWS)
    assert run["duration_s"] == pytest.approx((ROWS - 1) / 100.0)
    assert run["happened"] == "run, 1 change of setpoint, up to 30 N, 7.0 to 49.0 N measured"
    assert ladder["happened"].startswith("calibration ladder of 3 groups of 0.5 V stairs, ")
    assert "is not a recording" in newest["fault"]


def test_a_recording_that_grows_is_read_again(page, state) -> None:
    path = record(state)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    assert page.get("/api/v1/recordings").json["recordings"][0]["rows"] < ROWS
    path.write_bytes(whole)
    assert page.get("/api/v1/recordings").json["recordings"][0]["rows"] == ROWS


def test_starting_and_stopping_goes_to_control(page, control) -> None:
    assert page.post("/api/v1/recordings/start").json["recording"].endswith("0001.fgr")
    assert page.get("/api/v1/recordings").json["recording"]["recording"].endswith("0001.fgr")
    assert page.post("/api/v1/recordings/stop").json["recording"] is None
    assert [request["on"] for request in control.asked if "on" in request] == [True, False]


@pytest.mark.parametrize("form", ["csv", "parquet"])
def test_a_download_is_the_recording_and_leaves_no_file_behind(page, state, tmp_path, monkeypatch, form) -> None:
    room = tmp_path / "room"
    room.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(room))
    original = read_recording(record(state))
    answer = page.get(f"/api/v1/recordings/1/download.{form}")
    assert answer.headers["content-disposition"] == f'attachment; filename="demo-0001.{form}"'
    copy = tmp_path / f"copy.{form}"
    copy.write_bytes(answer.body)
    table = read_table(copy)
    for name, column in original.columns.items():
        assert np.array_equal(table.columns[name], column), name
    deadline_s = time.monotonic() + 5.0
    while list(room.iterdir()) and time.monotonic() < deadline_s:  # it goes once the answer has ended
        page.get("/api/v1/recordings")
    assert not list(room.iterdir())


def test_a_machine_without_room_for_the_copy_is_not_taken_for_a_gateway_that_is_away(
    page, state, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on a full disk, or in a container that is read-only."""
    record(state)
    monkeypatch.setattr(tempfile, "tempdir", None)
    monkeypatch.setattr(tempfile, "_candidate_tempdir_list", list)
    told = page.get("/api/v1/recordings/1/download.csv")
    assert (told.status, told.json["error"]) == (503, "No usable temporary directory found in []")
    assert page.post("/api/v1/recordings/start").json["error"].startswith("the gateway does not answer")


def test_parquet_without_its_library_is_refused_with_what_brings_it(page, state, monkeypatch) -> None:
    """It ended in an internal error of the page's."""
    record(state)
    monkeypatch.setattr(extras, "is_installed", lambda library: library != "pyarrow")
    told = page.get("/api/v1/recordings/1/download.parquet")
    assert (told.status, told.json["error"][:4]) == (409, "E160")


def test_another_form_is_refused(page, state) -> None:
    record(state)
    assert "csv or parquet" in page.get("/api/v1/recordings/1/download.exe").json["error"]


def test_a_picture_is_a_page_that_runs_nothing(page, state) -> None:
    record(state, rig="<script>alert(1)</script>")
    answer = page.get("/api/v1/recordings/1/plot")
    assert "default-src 'none'" in answer.headers["content-security-policy"]
    assert "sandbox" in answer.headers["content-security-policy"]
    assert b"<script" not in answer.body
    assert b"5.0\xc2\xa0s" in answer.body
    assert answer.body.count(b"<polyline") == 3  # setpoint, measured, command


def test_a_thinned_curve_keeps_its_peaks() -> None:
    time_s = np.arange(100_000) / 100.0
    values = np.sin(time_s)
    values[54_321] = 9.0
    values[100] = np.nan
    shown_s, shown = _thinned(time_s, values)
    assert len(shown) <= 1400
    assert max(shown) == 9.0
    assert shown_s == sorted(shown_s)


def test_a_download_of_the_right_size_is_sent_whole(page, state) -> None:
    path = record(state)
    body = page.get("/api/v1/recordings/1/download.csv").body
    assert len([line for line in io.BytesIO(body) if not line.startswith(b"#")]) == ROWS + 1
    assert Path(path).exists()
