"""`record --for`: asks the gateway for a recording that ends by itself, waits for it, and a Ctrl-C keeps what there is."""

import json
from pathlib import Path
from typing import Any

import pytest

from gateway.cli.errors import CliError
from gateway.processes import exit_codes
from gateway.recording import Recorder, list_recordings


class ScriptedGateway:
    """Answers as control does; the recording is over after so many looks."""

    def __init__(self, state: Path, looks: int = 3) -> None:
        self.state, self.looks = state, looks
        self.asked: list[dict[str, Any]] = []
        self.recorder: Recorder | None = None
        self.began_in = Path()
        self.restarts_at = self.replaced_at = 0

    def ask(self, state: Path, request: dict[str, Any]) -> dict[str, Any]:
        self.asked.append(request)
        if request.get("on"):
            header = {key: request[key] for key in ("name", "note") if key in request}
            self.began_in = self._begin(header)
        elif len(self.asked) == self.restarts_at:
            self._end()
            self._begin({})
            raise CliError("E140 no gateway answers", exit_codes.DEVICE)
        elif len(self.asked) == self.replaced_at:
            self._end()
            self.began_in = self._begin({})
        elif request.get("on") is False or len(self.asked) > self.looks:
            self._end()
        if not (self.recorder and self.recorder.is_open):
            return {"recording": None}
        return {"recording": str(self.recorder.path), "began_in": str(self.began_in)}

    def _begin(self, header: dict[str, Any]) -> Path:
        self.recorder = Recorder(self.state / "recordings", header, ("time_s",))
        self.recorder.append((0.0,))
        self.recorder.append((1.5,))
        return self.recorder.path

    def _end(self) -> None:
        assert self.recorder
        self.recorder.close()


@pytest.fixture
def gateway(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ScriptedGateway:
    gateway = ScriptedGateway(tmp_path)
    monkeypatch.setattr("gateway.cli.control_socket.ask", gateway.ask)
    monkeypatch.setattr("gateway.cli.verbs.diagnosis.record._LOOK_S", 0.0)
    return gateway


def test_it_waits_for_the_end_and_says_what_was_recorded(gateway: ScriptedGateway, call, tmp_path: Path) -> None:
    answer = call("record", "--for", "90s", "--name", "a b", "--note", "why", "--state", tmp_path)
    assert answer.exit_code == 0, answer.output
    assert "recorded 2 rows (1.5 s) to " in answer.output
    assert gateway.asked[0] == {"do": "record", "on": True, "name": "a b", "note": "why", "for_s": 90.0}
    assert gateway.asked[-1] == {"do": "record"}
    assert list_recordings(tmp_path)[0].header["note"] == "why"


def test_a_restart_of_control_in_between_is_waited_for_and_its_other_file_told(
    gateway: ScriptedGateway, call, tmp_path: Path
) -> None:
    gateway.restarts_at = 2
    answer = call("record", "--for", "90s", "--state", tmp_path)
    assert answer.exit_code == 0, answer.output
    first, second = (tmp_path / "recordings" / name for name in ("0001.fgr", "0002.fgr"))
    assert f"recorded 4 rows (3.0 s) to {first}, then to {second}" in answer.output


def test_another_recording_behind_ours_is_not_waited_for(gateway: ScriptedGateway, call, tmp_path: Path) -> None:
    gateway.replaced_at, gateway.looks = 3, 10_000
    answer = call("record", "--for", "90s", "--state", tmp_path)
    assert f"recorded 2 rows (1.5 s) to {tmp_path / 'recordings' / '0001.fgr'}\n" in answer.output
    assert len(gateway.asked) == 3
    gateway.ask(tmp_path, {"do": "record", "on": False})


def test_ctrl_c_ends_it_and_keeps_it(
    gateway: ScriptedGateway, call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def press(seconds: float) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("gateway.cli.verbs.diagnosis.record.time.sleep", press)
    answer = call("record", "--for", "1h", "--json", "--state", tmp_path)
    assert gateway.asked[-1] == {"do": "record", "on": False}
    said = json.loads(answer.stdout)
    assert (said["stopped"], said["rows"]) == (True, 2)
    assert list_recordings(tmp_path)[0].rows == 2


@pytest.mark.parametrize(
    ("words", "asked"),
    [
        (("off",), {"do": "record", "on": False}),
        (("on",), {"do": "record", "on": True}),
        (("--name", "a"), {"do": "record", "on": True, "name": "a"}),
        (("status",), {"do": "record"}),
        ((), {"do": "record"}),
    ],
)
def test_the_gateway_is_asked_for_what_was_said(
    words: tuple[str, ...], asked: dict[str, Any], call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    heard = list[dict[str, Any]]()
    monkeypatch.setattr("gateway.cli.control_socket.ask", lambda _, request: heard.append(request) or {})
    assert call("record", *words, "--state", tmp_path).exit_code == 0
    assert heard == [asked]


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("off", "--for", "3s"), "of a recording that starts"),
        (("status", "--name", "x"), "of a recording that starts"),
        (("--for", "soon"), "no duration"),
        (("--for", "0s"), "no duration"),
        (("on", "--note", "x" * 1001), "1 to 1000"),
        (("on", "--name", "7"), "no name"),
    ],
)
def test_what_makes_no_sense_is_refused_before_anybody_is_asked(
    words: tuple[str, ...], why: str, gateway: ScriptedGateway, call, tmp_path: Path
) -> None:
    answer = call("record", *words, "--state", tmp_path)
    assert (answer.exit_code, gateway.asked) == (2, [])
    assert why in " ".join(answer.output.split())


FULL = "E402 recording 0001.fgr stopped after 2 rows: No space left on device; control goes on"


@pytest.mark.parametrize("is_dropped", [False, True])
def test_a_disk_that_has_ended_it_before_its_time_is_told_and_no_success(
    is_dropped: bool, gateway: ScriptedGateway, call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was told as recorded, with exit code 0; where no row was taken its file was missed (E106)."""

    def ask(state: Path, request: dict[str, Any]) -> dict[str, Any]:
        answer = gateway.ask(state, request)
        if answer["recording"] is None and is_dropped:
            gateway.recorder.path.unlink()
        return answer if answer["recording"] else {"recording": None, "waits": FULL}

    monkeypatch.setattr("gateway.cli.control_socket.ask", ask)
    answer = call("record", "--for", "90s", "--json", "--state", tmp_path)
    said = json.loads(answer.stdout)
    assert (said["rows"], said["fault"]) == (0 if is_dropped else 2, FULL)
    assert answer.exit_code == 1 and "No space left on device" in answer.stderr and "not the 90 s" in answer.stderr


def test_another_file_in_which_it_goes_on_is_told(
    gateway: ScriptedGateway, call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As after a day, or with another plant."""

    def ask(state: Path, request: dict[str, Any]) -> dict[str, Any]:
        answer = gateway.ask(state, request)
        return answer | {"recording": "0002.fgr"} if len(gateway.asked) == 3 else answer

    monkeypatch.setattr("gateway.cli.control_socket.ask", ask)
    answer = call("record", "--for", "90s", "--state", tmp_path)
    assert answer.exit_code == 0 and "0001.fgr, then to 0002.fgr" in answer.output
