"""`events`: what was said, as it was said; filters, forms, and files that are not whole."""

import json
import os
import threading
from itertools import islice
from pathlib import Path

import pytest

from gateway.cli.verbs.history import events as verb
from gateway.processes.event import encode_event, make_event, utc_text
from gateway.processes.event_file import EventFile, EventReader

NOON_S = 1_795_348_800.0
SAID = [
    (-7200.0, "control", "control", "enabled by 10.0.0.5"),
    (-600.0, "control", "refusal 10.0.0.5 out_of_range", "W204 force_setpoint = 65.00 N"),
    (-300.0, "watch", "residual", "A345 friction has doubled"),
    (-60.0, "guardian", "restart", "A401 control process died (SIGKILL): safe voltage acknowledged"),
]


@pytest.fixture
def state(tmp_path: Path, monkeypatch) -> Path:
    monkeypatch.setattr(verb.time, "time", lambda: NOON_S)
    (tmp_path / "state").mkdir()
    file = EventFile(tmp_path / "state")
    for at_s, source, cause, sentence in SAID:
        file.append(encode_event(make_event(NOON_S + at_s, source, cause, sentence)))
    file.close()
    return tmp_path / "state"


def codes(output: str) -> list[str | None]:
    return [json.loads(line)["code"] for line in output.splitlines()]


def test_all_of_it_for_people(state: Path, call) -> None:
    answer = call("events", "--state", state)
    assert answer.exit_code == 0
    assert answer.output.splitlines() == [
        "2026-11-22T10:00:00.000Z info    control enabled by 10.0.0.5",
        "2026-11-22T11:50:00.000Z warning refusal W204 force_setpoint = 65.00 N",
        "2026-11-22T11:55:00.000Z warning residual A345 friction has doubled",
        "2026-11-22T11:59:00.000Z error   restart A401 control process died (SIGKILL): safe voltage acknowledged",
    ]


def test_json_is_one_object_per_line(state: Path, call) -> None:
    lines = call("events", "--state", state, "--json").output.splitlines()
    assert json.loads(lines[3]) == {
        "time": "2026-11-22T11:59:00.000Z",
        "severity": "error",
        "code": "A401",
        "cause": "restart",
        "text": "control process died (SIGKILL): safe voltage acknowledged",
        "source": "guardian",
    }
    assert json.loads(lines[0])["code"] is None


@pytest.mark.parametrize(
    ("options", "result"),
    [
        (["--since", "10m"], ["W204", "A345", "A401"]),
        (["--since", "301s"], ["A345", "A401"]),
        (["--since", "1.5h"], ["W204", "A345", "A401"]),
        (["--since", "2d"], [None, "W204", "A345", "A401"]),
        (["--since", "2026-11-22T11:55:00Z"], ["A345", "A401"]),
        (["--since", "2026-11-22T12:55:00+01:00"], ["A345", "A401"]),
        (["--since", "2026-11-22 11:55"], ["A345", "A401"]),
        (["--since", "2026-11-23"], []),
        (["--severity", "warning"], ["W204", "A345", "A401"]),
        (["--severity", "error"], ["A401"]),
        (["--code", "w204", "--code", "A401"], ["W204", "A401"]),
        (["--code", "W204", "--severity", "error"], []),
    ],
)
def test_filters(options: list[str], result: list[str | None], state: Path, call) -> None:
    answer = call("events", "--state", state, "--json", *options)
    assert (answer.exit_code, codes(answer.output)) == (0, result)


@pytest.mark.parametrize("wrong", ["10", "10x", "yesterday", "-5m", "9" * 400 + "d", "99999999999d"])
def test_a_time_that_is_none_is_told(wrong: str, state: Path, call) -> None:
    answer = call("events", "--state", state, "--since", wrong)
    if answer.exit_code == 0:  # so long ago is everything
        assert wrong.endswith("d")
        assert len(answer.output.splitlines()) == 4
    else:
        assert answer.exit_code == 2
        assert "is neither 90s, 10m" in answer.stderr


def test_rotated_files_are_read_and_a_torn_line_is_not(state: Path, call) -> None:
    path = state / "events.jsonl"
    whole = path.read_bytes()
    (state / "events.jsonl.1").write_bytes(encode_event(make_event(NOON_S - 9000, "control", "x", "E402 before")))
    path.write_bytes(whole + whole[:50])
    answer = call("events", "--state", state, "--json")
    assert codes(answer.output) == ["E402", None, "W204", "A345", "A401"]


def test_a_state_without_events_has_none_and_no_state_is_told(tmp_path: Path, call) -> None:
    assert (call("events", "--state", tmp_path).exit_code, call("events", "--state", tmp_path).output) == (0, "")
    answer = call("events", "--state", tmp_path / "nowhere")
    assert (answer.exit_code, answer.stderr[:5]) == (65, "E106 ")


def test_following_shows_what_comes(state: Path, call, monkeypatch) -> None:
    file, slept = EventFile(state), threading.Event()

    def meanwhile(seconds: float) -> None:
        if slept.is_set():
            raise KeyboardInterrupt
        slept.set()
        file.append(encode_event(make_event(NOON_S, "control", "x", "A313 too much force")))

    monkeypatch.setattr(verb.time, "sleep", meanwhile)
    answer = call("events", "--state", state, "--follow", "--json", "--severity", "error")
    file.close()
    assert codes(answer.output) == ["A401", "A313"]


def test_following_ends_with_who_reads_it(state: Path, monkeypatch) -> None:
    """`events --follow | grep -m1 A310` stood behind its line until another wanted event came, which may be days."""
    read_end, write_end = os.pipe()
    with os.fdopen(write_end, "w") as out, EventReader(state) as reader:
        monkeypatch.setattr(verb.sys, "stdout", out)
        monkeypatch.setattr(verb.time, "sleep", lambda seconds: pytest.fail("it waited"))
        assert not verb._reader_goes_within(0.0), "it is read"
        os.close(read_end)
        shown = verb._events_of(reader, "", follow=True)
        assert len(list(islice(shown, len(SAID)))) == len(SAID)
        monkeypatch.setattr(reader, "read_new", lambda: pytest.fail("it reads on, for nobody"))
        assert not list(shown)


@pytest.mark.parametrize("since", ["10m", "2026-11-22T11:50"])
def test_behind_a_clock_that_was_set_back_it_is_read_on(since: str, state: Path, call, monkeypatch) -> None:
    """A fault of after it had the time of an hour before: `--since` showed neither it nor, with `--follow`, what came."""
    file, slept = EventFile(state), threading.Event()

    def append(before_s: float, sentence: str) -> None:
        file.append(encode_event(make_event(NOON_S - before_s, "control", "x", sentence)))

    def meanwhile(seconds: float) -> None:
        if slept.is_set():
            raise KeyboardInterrupt
        slept.set()
        append(3500.0, "A313 too much force")

    append(3600.0, "A310 master lost")
    monkeypatch.setattr(verb.time, "sleep", meanwhile)
    answer = call("events", "--state", state, "--json", "--severity", "error", "--since", since, "--follow")
    file.close()
    assert codes(answer.output) == ["A401", "A310", "A313"]


def test_a_clock_that_was_far_ahead_once_makes_nothing_young(state: Path, call) -> None:
    file = EventFile(state)
    for at_s, code in ((86400.0, "A310"), (-7200.0, "A311"), (-1.0, "A312")):
        file.append(encode_event(make_event(NOON_S + at_s, "control", "x", f"{code} so it was")))
    file.close()
    assert codes(call("events", "--state", state, "--json", "--since", "30s").output) == ["A310", "A312"]


def test_a_backup_has_the_events_while_they_are_written(state: Path, call, tmp_path: Path) -> None:
    (state / "events.jsonl.1").write_bytes((state / "events.jsonl").read_bytes())
    assert call("backup", tmp_path / "b.tar.gz", "--state", state).exit_code == 0
    assert call("restore", tmp_path / "b.tar.gz", "--state", tmp_path / "new").exit_code == 0
    assert len(call("events", "--state", tmp_path / "new", "--json").output.splitlines()) == 8


def test_a_file_that_gets_another_name_during_a_backup_is_no_failure(
    state: Path, call, tmp_path: Path, monkeypatch
) -> None:
    from gateway.cli import state_archive

    listed = list(state_archive._files(state))
    monkeypatch.setattr(state_archive, "_files", lambda directory: iter([*listed, state / "events.jsonl.4"]))
    answer = call("backup", tmp_path / "b.tar.gz", "--state", state)
    assert answer.exit_code == 0, answer.output
    assert "1 file" in answer.output


def test_times_sort_as_texts() -> None:
    assert utc_text(0.0) == "1970-01-01T00:00:00.000Z"
    assert utc_text(NOON_S) < utc_text(NOON_S + 0.001) < utc_text(NOON_S + 86400)


def test_a_code_that_there_is_none_of_is_no_event_that_never_came(state: Path, call) -> None:
    """`events --code W2O4` printed nothing and ended well: who looked for refusals heard that there were none."""
    assert codes(call("events", "--state", state, "--json", "--code", "out_of_range").output) == ["W204"]
    for word, said in (("W2O4", "W2O4 is not a code; did you mean W2"), ("W", "W is not a code")):
        answer = call("events", "--state", state, "--code", word)
        assert answer.exit_code == 2 and said in answer.stderr and not answer.stdout
