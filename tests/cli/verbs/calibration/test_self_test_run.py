"""The run behind `self-test`: stopped by whatever ends the verb, kept alive by heartbeats, told by its own gateway."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gateway import defaults
from gateway.cli.errors import CliError
from gateway.cli.master import first_heartbeat
from gateway.cli.verbs.calibration import self_test
from gateway.processes import exit_codes
from gateway.profiles import load_register_map
from gateway.registers.words import ControlBit, SelfTestResult

START = int(ControlBit.START_SELF_TEST)


class Registers:
    """A gateway whose self-test goes on until it is stopped. lost: how often no answer comes back; hears: those are heard."""

    def __init__(self, heartbeat: int = 7) -> None:
        self.register_map = load_register_map(defaults.REGISTER_MAP)
        self.values: dict[str, float] = {"heartbeat": heartbeat, "calibration_progress": 250.0}
        self.words: list[dict[str, int]] = []
        self.lost, self.hears = 0, True

    def _lose(self) -> None:
        if self.lost:
            self.lost -= 1
            raise CliError("E131 no answer", exit_codes.DEVICE)

    def read_values(self, registers: list[Any]) -> list[Any]:
        self._lose()
        return [SimpleNamespace(value=self.values.get(register.name, 0.0)) for register in registers]

    def frames(self, assignments: list[Any]) -> list[dict[str, int]]:
        return [{each.register.name: int.from_bytes(each.data, "big") for each in assignments}]

    def write(self, frame: dict[str, int]) -> None:
        if self.hears or not self.lost:
            self.words.append(frame)
            is_running = frame.get("control_word", START) == START
            self.values["self_test_result"] = SelfTestResult.RUNNING if is_running else SelfTestResult.STOPPED
        self._lose()


@pytest.fixture
def gateway(monkeypatch: pytest.MonkeyPatch) -> Registers:
    monkeypatch.setattr(self_test, "_LOOK_S", 0.0)
    return Registers()


def run_of(gateway: Registers) -> self_test._SelfTest:
    return self_test._SelfTest(gateway)  # type: ignore[arg-type]


@pytest.mark.parametrize("is_heard", [True, False])
def test_a_start_whose_answer_is_lost_is_stopped_where_it_was_heard(gateway: Registers, is_heard: bool) -> None:
    """Left alone it would press with nobody there; and where it was not heard what presses is another master's."""
    run = run_of(gateway)
    gateway.hears, frames = is_heard, gateway.frames

    def lose_the_first(assignments: list[Any]) -> list[dict[str, int]]:
        gateway.lost, gateway.frames = 1, frames  # type: ignore[method-assign]
        return frames(assignments)

    gateway.frames = lose_the_first  # type: ignore[method-assign]
    told = "the self-test was stopped; the force went to 0" if is_heard else "the self-test has not begun"
    with pytest.raises(CliError, match=rf"(?s)E131.*\n  {told}$"):
        self_test._run_to_its_end(run, shows=False)
    assert [frame.get("control_word") for frame in gateway.words] == ([START, 0] if is_heard else [])


@pytest.mark.parametrize("end", [KeyboardInterrupt, BrokenPipeError])
def test_a_terminal_that_is_gone_stops_it_as_ctrl_c_does(
    gateway: Registers, end: type[BaseException], monkeypatch: pytest.MonkeyPatch
) -> None:
    def gone(*_: object) -> None:
        raise end

    monkeypatch.setattr(self_test._SelfTest, "_show", gone)
    with pytest.raises(CliError, match="stopped; the force went to 0"):
        self_test._run_to_its_end(run_of(gateway), shows=True)
    assert [frame["control_word"] for frame in gateway.words if "control_word" in frame] == [START, 0]


def test_a_stop_that_is_lost_too_hides_nothing_of_why(gateway: Registers, monkeypatch: pytest.MonkeyPatch) -> None:
    """And that it may press on there is told: the verb ended with the lost answer alone."""

    def lose_the_rest(_seconds: float) -> None:
        gateway.lost = 9

    monkeypatch.setattr(self_test, "time", SimpleNamespace(sleep=lose_the_rest, monotonic=lambda: 0.0))
    with pytest.raises(
        CliError, match=r"E131 no answer\n  whether the self-test goes on there nobody knows; it ends by itself"
    ):
        self_test._run_to_its_end(run_of(gateway), shows=False)
    assert gateway.words[-1]["control_word"] == 0


def test_a_test_that_does_not_end_is_stopped_after_half_a_minute(
    gateway: Registers, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And beats until then, each time with another value, from one that is drawn."""
    gateway = Registers(heartbeat=7)
    monkeypatch.setattr(first_heartbeat, "randrange", lambda first, end: 0xFFFE - 7)
    time = SimpleNamespace(now_s=0.0, monotonic=lambda: time.now_s)
    time.sleep = lambda _seconds: setattr(time, "now_s", time.now_s + 1.0)
    monkeypatch.setattr(self_test, "time", time)
    with pytest.raises(CliError, match="did not end within 30 s"):
        self_test._run_to_its_end(run_of(gateway), shows=False)
    assert 30.0 < time.now_s < 33.0 and gateway.words[-1]["control_word"] == 0
    assert [frame["heartbeat"] for frame in gateway.words][:4] == [0xFFFF, 0, 1, 2]


def test_a_gateway_that_has_started_anew_is_told_and_no_test_without_a_result(
    gateway: Registers, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was told as `self-test 0 none`."""

    def start_anew(_seconds: float) -> None:
        gateway.values.clear()
        gateway.write = lambda frame: None  # type: ignore[method-assign]

    monkeypatch.setattr(self_test, "time", SimpleNamespace(sleep=start_anew, monotonic=lambda: 0.0))
    with pytest.raises(CliError, match="A401 the gateway has started anew"):
        self_test._run_to_its_end(run_of(gateway), shows=False)


def test_one_that_runs_already_is_another_masters_and_neither_followed_nor_stopped(gateway: Registers) -> None:
    gateway.values["self_test_result"] = SelfTestResult.RUNNING
    with pytest.raises(CliError, match="W310 a self-test runs there already"):
        self_test._run_to_its_end(run_of(gateway), shows=False)
    assert gateway.words == []


def test_what_is_said_of_its_end_begins_a_line(gateway: Registers, monkeypatch: Any, capsys: Any) -> None:
    """A terminal read `self-test  52 %,  5 s left,   6.57 N^Cself-test stopped; the force went to 0`."""
    show = self_test._SelfTest._show

    def interrupt(run: self_test._SelfTest) -> None:
        show(run)
        raise KeyboardInterrupt

    monkeypatch.setattr(self_test._SelfTest, "_show", interrupt)
    with pytest.raises(CliError, match="stopped"):
        self_test._run_to_its_end(run_of(gateway), shows=True)
    assert capsys.readouterr().err.endswith(" N\r")  # what erases it goes to terminals alone


def test_progress_is_told_in_percent(gateway: Registers, capsys: pytest.CaptureFixture[str]) -> None:
    run_of(gateway)._show()
    assert "self-test  25 %" in capsys.readouterr().err


@pytest.mark.parametrize(("is_ours", "number", "texts"), [(True, 65537, "leak 0.1 N"), (True, 2, ""), (False, 1, "")])
def test_the_numbers_of_an_item_are_of_this_gateway_and_this_test(
    gateway: Registers, monkeypatch: pytest.MonkeyPatch, is_ours: bool, number: int, texts: str
) -> None:
    """The registers count to 65535 and begin again."""
    answers = {"running": {}, "self-test": {"number": number, "items": {"leak": {"text": "leak 0.1 N"}}}}
    monkeypatch.setattr("gateway.cli.control_socket.ask", lambda directory, request: answers[request["do"]])
    monkeypatch.setattr("gateway.cli.master.local_gateways.sockets_near", lambda wire, root: [Path()])
    gateway.values["self_test_count"] = 1.0
    answer = run_of(gateway).answer(SimpleNamespace(is_served_by=lambda _running: is_ours))  # type: ignore[arg-type]
    assert answer["items"]["leak"]["text"] == texts
