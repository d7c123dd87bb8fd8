"""`audit show` and `audit verify`: what they choose, and that a broken record is never told as one that holds."""

import json
from pathlib import Path

import pytest

from gateway.audit.audit_file import AuditFile, audit_files
from gateway.audit.write_series import WriteSeries
from gateway.cli.verbs.history.audit import format_record
from tests.audit.appending import append


@pytest.fixture
def state(tmp_path: Path) -> Path:
    file = AuditFile(tmp_path, 1 << 20)
    for minute, peer in enumerate(("10.0.0.5:1", "10.0.0.6:2", "robot (10.0.0.5:3)")):
        record = {
            "time": f"2026-11-22T10:0{minute}:00.000Z",
            "peer": peer,
            "what": "force_setpoint",
            "old": 1,
            "new": 2,
        }
        append(file, [record])
    file.close()
    return tmp_path


def numbers(output: str) -> list[int]:
    return [json.loads(line)["n"] for line in output.splitlines()]


@pytest.mark.parametrize(
    ("words", "shown"),
    [
        ((), [1, 2, 3]),
        (("--peer", "10.0.0.5"), [1, 3]),
        (("--peer", "robot"), [3]),
        (("--peer", "10.0.0.7"), []),
        (("--since", "2026-11-22T10:01"), [2, 3]),
        (("--since", "2026-11-22T11:01+01:00", "--peer", "10.0.0.6"), [2]),
        (("--since", "2026-11-22T10:03"), []),
    ],
)
def test_only_who_and_what_was_asked_for_is_shown(state: Path, call, words: tuple[str, ...], shown: list[int]) -> None:
    answer = call("audit", "show", "--json", *words, "--state", state)
    assert answer.exit_code == 0 and numbers(answer.output) == shown


@pytest.mark.parametrize(("altered", "held"), [(1, "nothing holds"), (2, "1 line holds"), (3, "2 lines hold")])
def test_how_many_lines_hold_is_told_in_the_right_number(state: Path, call, altered: int, held: str) -> None:
    """E170 said that "the 1 lines before it hold"."""
    (path,) = audit_files(state / "audit")
    lines = path.read_bytes().splitlines(keepends=True)
    assert call("audit", "verify", "--state", state).stdout.startswith("3 lines hold, ")
    lines[altered - 1] = lines[altered - 1].replace(b'"what"', b'"whet"')
    path.write_bytes(b"".join(lines))
    assert call("audit", "verify", "--state", state).stderr.endswith(f"; before it {held}\n")


def test_behind_a_clock_that_was_set_back_it_is_read_on(state: Path, call) -> None:
    file = AuditFile(state, 1 << 20)
    append(
        file, [{"time": "2026-11-22T09:00:00.000Z", "peer": "10.0.0.5:1", "what": "force_setpoint", "old": 2, "new": 3}]
    )
    file.close()
    answer = call("audit", "show", "--json", "--since", "2026-11-22T10:02", "--state", state)
    assert numbers(answer.output) == [3, 4]


def test_a_broken_record_is_said_to_hold_nowhere(state: Path, call) -> None:
    (path,) = (state / "audit").glob("*.jsonl")
    path.write_bytes(path.read_bytes().replace(b"10.0.0.6", b"10.0.0.8"))
    for words in ((), ("--json",)):
        answer = call("audit", "verify", *words, "--state", state)
        assert answer.exit_code == 1 and answer.stderr.startswith("E170 ")
        assert "hold, up to" not in answer.stdout
    assert json.loads(answer.stdout)["broken"]["line"] == 2


def test_a_changed_line_is_not_left_out_without_a_word(state: Path, call) -> None:
    (path,) = (state / "audit").glob("*.jsonl")
    path.write_bytes(path.read_bytes().replace(b"10.0.0.6", b"10.0.0.8") + b'{"n": 4, "ti')
    answer = call("audit", "show", "--json", "--state", state)
    assert numbers(answer.stdout) == [1, 3]
    assert answer.stderr.startswith("E170 1 line was changed or damaged, and left out")


def test_a_line_that_a_power_cut_has_left_is_told_apart(state: Path, call) -> None:
    (path,) = (state / "audit").glob("*.jsonl")
    path.write_bytes(path.read_bytes() + b'{"n": 4, "ti')
    answer = call("audit", "verify", "--state", state)
    assert answer.exit_code == 0 and answer.stdout.startswith("3 lines hold, up to line 3, ")
    assert "incomplete line (12 bytes)" in answer.stdout


@pytest.mark.parametrize(
    ("what", "value", "told"),
    [
        ("enable", None, "  enable  (20 writes in 10 s)"),
        ("owner", None, "  owner  (20 writes in 10 s)"),
        ("write", 72.0, "  write  (20 writes in 10 s, 72 .. 72)  72 N is too much"),
    ],
)
def test_a_summary_without_values_before_and_after_names_none(what: str, value: float | None, told: str) -> None:
    """`enable  nobody -> nobody` was told of a robot that had enabled often, and of its refused writes `nobody -> 72`."""
    series = WriteSeries(20, {"peer": "10.0.0.5", "what": what} | ({"text": "72 N is too much"} if value else {}))
    for _ in range(40):
        series.take(None, value)
    assert format_record({"time": "T", **(series.summarize(10.0) or {})}).endswith(told)


def test_of_an_owner_that_came_or_went_nobody_is_told() -> None:
    assert format_record({"what": "owner", "old": None, "new": "10.0.0.5"}).endswith("owner  nobody -> 10.0.0.5")
    assert format_record({"what": "owner", "old": "10.0.0.5", "new": None}).endswith("owner  10.0.0.5 -> nobody")


@pytest.mark.parametrize(
    "fields",
    [
        {"time": 5, "what": "a"},
        {"time": "2026", "what": "b", "result": None},
        {"time": "2026", "count": 3, "seconds": "long"},
        {"time": "2026", "count": 3, "seconds": 3.0, "min": "a"},
    ],
)
def test_a_line_that_somebody_has_written_who_knows_how_hides_none_behind_it(tmp_path: Path, call, fields) -> None:
    """`audit show` ended at it with an internal error."""
    file = AuditFile(tmp_path)
    append(file, [fields, {"time": "2027-01-01T00:00:00.000Z", "what": "enable"}])
    file.close()
    for words in ((), ("--since", "2000-01-01"), ("--json",)):
        shown = call("audit", "show", *words, "--state", tmp_path)
        assert shown.exit_code == 0 and "enable" in shown.output.splitlines()[-1], shown.output
