"""What every tab refuses: commands of other sites, names that are no numbers, bodies that are not understood."""

import json

import pytest

from gateway.web.tabs.own_command import last_sentence
from tests.web.tabs.conftest import record

COMMANDS = (
    "calibrate/preview",
    "calibrate/start",
    "calibrate/stop",
    "recordings/start",
    "recordings/stop",
    "calibrations/change",
    "plants/change",
    "diagnosis/begin",
    "diagnosis/cancel",
)
FILES = (
    "recordings/{}/plot",
    "recordings/{}/download.csv",
    "recordings/{}/download.parquet",
    "calibrations/{}/report",
    "diagnosis/{}/report",
    "plants/{}/preview",
    "calibrations/compare?a={}&b=1",
    "plants/compare?a={}&b=1",
)
NO_NUMBERS = (
    "%2e%2e%2fsecret",
    "..%2f..%2fetc%2fpasswd",
    "0001%00",
    "-1",
    "1e3",
    "%D9%A1",
    "1.fgr",
    "9999999999",
    "1;2",
    "--help",
)


def test_every_command_needs_the_sessions_token(page, control) -> None:
    for path in COMMANDS:
        assert page.post(f"/api/v1/{path}", csrf=False).status == 403, path
    assert not control.count("calibrate")
    assert not control.count("record")


def test_files_are_named_by_numbers_and_by_nothing_else(page, state) -> None:
    record(state)
    (state / "secret.html").write_text("the content")
    (state / "calibrations").mkdir()
    (state / "calibrations" / "0007.html").write_text("the content")
    for name in NO_NUMBERS:
        for path in FILES:
            answer = page.get(f"/api/v1/{path.format(name)}")
            assert answer.status == 404, (path, name)
            assert b"the content" not in answer.body
            assert b"root:" not in answer.body


def test_a_number_without_a_file_is_told(page, state) -> None:
    record(state)
    assert "no recording 9 in" in page.get("/api/v1/recordings/9/plot").json["error"]
    assert "has no report" in page.get("/api/v1/calibrations/9/report").json["error"]
    assert "was not diagnosed" in page.get("/api/v1/diagnosis/1/report").json["error"]
    assert "no recording 9 in" in page.post("/api/v1/diagnosis/begin", {"recording": 9}).json["error"]


@pytest.mark.parametrize(
    ("body", "names"),
    [
        (b"{", "no JSON"),
        (b"[" * 5000, "no JSON"),
        (json.dumps({"recording": "1"}).encode(), "recording"),
        (json.dumps({"recording": 1, "rig": "x"}).encode(), "rig"),
        (b"null", ""),
        (b"[]", ""),
    ],
)
def test_a_body_that_is_not_understood_is_refused_in_words(page, body, names) -> None:
    answer = page.post("/api/v1/diagnosis/begin", body)
    assert answer.status == 400
    assert names in answer.json["error"]


def test_without_a_gateway_a_tab_says_so_and_the_lists_still_work(page, state) -> None:
    record(state)
    assert page.get("/api/v1/calibrate").status == 503
    assert "does not answer" in page.post("/api/v1/recordings/start").json["error"]
    assert [one["number"] for one in page.get("/api/v1/recordings").json["recordings"]] == [1]


def test_what_a_verb_refuses_is_its_last_sentence_without_the_prefix_of_a_terminal() -> None:
    assert last_sentence("Usage: x\n\nError: E177 a run is under way\n \n") == "E177 a run is under way"
    assert last_sentence("\n") == ""
