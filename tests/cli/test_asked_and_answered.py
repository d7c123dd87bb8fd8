"""What verbs ask a running gateway for: what it refuses is told, what another has asked for is not waited for."""

import fcntl
import json
import socket
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.cli import change_in_use, control_socket
from gateway.cli.calibration import resume, store_access
from gateway.cli.change_in_use import ask_until_done, not_running
from gateway.cli.errors import CliError, NoAnswerError
from gateway.cli.master.client import Assignment, GatewayClient
from gateway.cli.system_service.installation import plan_installation
from gateway.cli.system_service.unit_file import STOP_S
from gateway.cli.verbs.operation import sim
from gateway.processes import exit_codes
from gateway.profiles import load_register_map, load_rig
from gateway.registers.words import UploadReason
from gateway.service.supervisor.control_child import STOP_BOUND_S


@pytest.mark.parametrize("answer", [{}, {"ok": False}, {"said": "nothing of the kind"}])
def test_an_answer_that_does_not_say_that_all_is_well_is_a_refusal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, answer: dict[str, Any]
) -> None:
    monkeypatch.chdir(tmp_path)  # a socket's path is short
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind("control.sock")
        listener.listen()

        def serve() -> None:
            peer, _ = listener.accept()
            with peer:
                peer.recv(1000)
                peer.sendall(json.dumps(answer).encode() + b"\n")

        thread = threading.Thread(target=serve)
        thread.start()
        with pytest.raises(CliError, match="E141 the gateway refused without a reason"):
            control_socket.ask(Path(), {"do": "running"})
        thread.join()


def test_another_ones_job_is_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ours has ended when theirs began; theirs may take as long as it wants."""
    answers = iter([{"busy": True, "job": 1}, {"busy": True, "job": 1}, {"busy": True, "job": 2}])
    monkeypatch.setattr(change_in_use, "ask", lambda directory, request: next(answers))
    assert ask_until_done(Path(), "calibration", {"use": 2})["job"] == 2


def test_a_change_is_told_its_own_end_though_another_ones_came_behind_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """A rollback that failed beside a `calibration use 1` said that 1 was in use, and ended with 0."""
    own, other = {"said": "E433 nothing to go back to", "failed": True}, {"said": "1 in use", "failed": False}
    later = {"busy": False, "job": 2, "ends": {"1": own, "2": other}, **other}
    answers = iter(
        [{"busy": True, "job": 1, "ends": {}}, later, {"busy": True, "job": 1}, later | {"ends": {"2": other}}]
    )
    monkeypatch.setattr(change_in_use, "ask", lambda directory, request: next(answers))
    answer = ask_until_done(Path(), "calibration", {"rollback": True})
    assert (answer["said"], answer["failed"]) == (own["said"], True) and "ends" not in answer
    with pytest.raises(NoAnswerError, match=r"E140 the gateway no longer knows how it went"):
        ask_until_done(Path(), "calibration", {"rollback": True})


def test_a_change_without_an_end_is_not_waited_for_without_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(change_in_use, "_PATIENCE_S", 0.05)
    monkeypatch.setattr(change_in_use, "ask", lambda directory, request: {"busy": True, "job": 1})
    with pytest.raises(
        NoAnswerError, match=r"E431 the gateway has not answered for .*; it may make the change all the same"
    ):
        ask_until_done(Path(), "calibration", {"use": 2})


def test_a_gateway_that_is_gone_while_it_changes_may_have_made_the_change(monkeypatch: pytest.MonkeyPatch) -> None:
    answers = iter([{"busy": True, "job": 1}])

    def asked(directory: Path, request: dict[str, Any]) -> dict[str, Any]:
        for answer in answers:
            return answer
        raise CliError("E140 no gateway answers", exit_codes.DEVICE)

    monkeypatch.setattr(change_in_use, "ask", asked)
    with pytest.raises(NoAnswerError, match=r"E140 .*; it may make .*: force-gateway plant list shows") as caught:
        ask_until_done(Path(), "plant", {"use": 2})
    assert caught.value.exit_code == exit_codes.DEVICE
    with pytest.raises(CliError, match=r"E140 no gateway answers Or .*: then try again$") as refused:
        ask_until_done(Path(), "plant", {"use": 2})
    assert not isinstance(refused.value, NoAnswerError), "of what was never asked nothing is done"


def test_two_changes_at_once_are_not_told_as_a_gateway_that_is_gone(tmp_path: Path) -> None:
    """`calibration use` beside `plant use` asked who held the lock, which was no gateway, and was told to start one."""
    with not_running(tmp_path) as is_first:
        assert is_first
        with pytest.raises(CliError, match=r"E140 .*another command is changing it: then try again$") as refused:
            store_access.change_calibration(tmp_path, "demo", {"use": 1})
    assert refused.value.exit_code == exit_codes.DEVICE


@pytest.mark.parametrize(("said", "told"), [(b"", "no answer"), (b"[]", "no answer"), (b"{", "E140")])
def test_a_gateway_that_ends_over_a_question_is_told_as_one_that_is_gone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, said: bytes, told: str
) -> None:
    monkeypatch.chdir(tmp_path)
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind("control.sock")
        listener.listen()

        def serve() -> None:
            peer, _ = listener.accept()
            with peer:
                peer.recv(1000)
                peer.sendall(said)

        thread = threading.Thread(target=serve)
        thread.start()
        with pytest.raises(NoAnswerError, match="E140 no gateway answers") as caught:
            control_socket.ask(Path(), {"do": "running"})
        thread.join()
    assert told in str(caught.value) and caught.value.exit_code == exit_codes.DEVICE


def test_a_state_directory_that_no_socket_fits_in_is_told_as_such(tmp_path: Path) -> None:
    """Its gateway runs, and says so at its start: whoever asked it was told that there is perhaps none (E140)."""
    with pytest.raises(
        CliError, match=r"E152 .* bytes of path, a socket takes 107: give a shorter --state DIR"
    ) as caught:
        control_socket.ask(tmp_path / ("x" * 107), {"do": "running"})
    assert caught.value.exit_code == exit_codes.DEVICE and "is it running" not in str(caught.value)


def test_a_gateway_of_another_user_is_told_as_such(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any) -> dict[str, Any]:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(control_socket, "_exchange", refuse)
    with pytest.raises(CliError, match=r"E105 control\.sock: belongs to the user who runs the gateway") as caught:
        control_socket.ask(Path(), {"do": "running"})
    assert caught.value.exit_code == exit_codes.PERMISSION


@pytest.mark.parametrize(
    ("reason", "code"), [(UploadReason.STORAGE, exit_codes.FAILED), (UploadReason.NOT_STORED, exit_codes.DATA)]
)
def test_a_change_that_failed_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reason: UploadReason, code: int
) -> None:
    answer = {"failed": True, "said": "E431 calibration not stored: No space left on device", "reason": int(reason)}
    monkeypatch.setattr(store_access, "ask_until_done", lambda *_: answer)
    with (tmp_path / "lock").open("a") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        with pytest.raises(CliError, match="E431") as failed:
            store_access.change_calibration(tmp_path, "demo", {"use": 2})
    assert failed.value.exit_code == code


def test_two_that_change_what_is_in_use_are_not_both_alone(tmp_path: Path) -> None:
    with not_running(tmp_path) as is_first_free, not_running(tmp_path) as is_second_free:
        assert (is_first_free, is_second_free) == (True, False)


def test_the_service_may_take_as_long_to_stop_as_a_ramp_does() -> None:
    """systemd would else kill it while the tool still presses."""
    assert STOP_S >= STOP_BOUND_S + 5.0


def test_no_more_registers_are_written_at_once_than_a_request_carries() -> None:
    register_map = load_register_map("force-v1")
    client = GatewayClient(SimpleNamespace(where=""), 1, register_map)  # type: ignore[arg-type]
    staged = [each for each in register_map.registers_of("staging") if 1002 <= each.address < 1140]
    frames = client.frames([Assignment(each, bytes(2 * each.words)) for each in staged])
    assert sum(len(frame.words) for frame in frames) == 138
    assert max(len(frame.words) for frame in frames) <= 123


def test_what_control_refuses_of_a_simulated_rig_does_not_happen(call: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """It judges and audits first; the rig's own process would do it all the same."""
    asked = list[str]()

    def ask(state: Path, request: dict[str, Any], name: str = "control.sock") -> dict[str, Any]:
        asked.append(name)
        if len(asked) == 1:
            return {"rig": "demo", "set": {}, "notes": []}
        raise CliError("E141 this rig is not simulated")

    monkeypatch.setattr(control_socket, "ask", ask)
    assert call("sim", "set", "cell.silent=true").exit_code == 1
    assert asked == ["control.sock", "rig.sock"]
    assert call("sim", "set", "cell.silent=true").exit_code == 1
    assert asked[2:] == ["control.sock"]


@pytest.mark.parametrize("hidden", ["/home/me", "/root", "/run/user/1000", "/tmp", "/var/tmp/x"])
def test_a_rig_where_the_service_cannot_see_it_is_refused(hidden: str) -> None:
    with pytest.raises(CliError, match=r"E107 .* the service sees nothing below"):
        plan_installation(f"{hidden}/cell.yaml", load_rig("demo"), networks=(), command=Path("/opt/fg/force-gateway"))


def recorded(number: int, groups: int, **header: Any) -> Any:
    ladder = {"groups": 2, "minor_points": 0, "step_v": 0.5, "v_max_v": None, "tare": True, "stairs": 40, "top_v": 7.0}
    return SimpleNamespace(
        number=number, path=Path(f"{number:04d}.fgr"), header={"ladder": ladder, **header}, climbed=groups
    )


def test_what_is_gone_of_a_ladder_is_climbed_again_and_no_zero_is_taken_under_force(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The slide has pressed since: what rests on it now is friction's, and the zero is that of the first part."""
    last = recorded(2, 1, continues=[1])
    monkeypatch.setattr(resume, "find_last_ladder", lambda paths: (last.path, last.header))
    monkeypatch.setattr(resume, "read_recording", lambda path: last)
    monkeypatch.setattr(resume, "_whole_groups", lambda recording: recording.climbed if recording else 0)
    monkeypatch.setattr(resume, "_is_finished", lambda recording: True)
    for beside, is_whole in ((recorded(1, 1), True), (None, False)):
        monkeypatch.setattr(resume, "_beside", lambda path, number, beside=beside: beside)
        rest = resume.find_rest_of_ladder(Path())
        assert rest.plan["tare"] is False and rest.plan["v_max_v"] == 7.0
        assert (rest.groups, rest.finished) == (2 if is_whole else 1, is_whole)
        assert rest.is_whole(rest.plan_with({})) is is_whole


def test_what_is_set_on_a_simulated_rig_is_told_in_its_unit_and_a_share_in_none(
    capsys: pytest.CaptureFixture[str],
) -> None:
    answer = {"rig": "demo", "set": {"creep.creep_share": 0.05, "cell.noise": 0.5, "cell.silent": True}, "notes": ["x"]}
    sim._tell(answer, as_json=False)
    told = ["rig demo: set now", "  creep.creep_share=0.05", "  cell.noise=0.5 N", "  cell.silent=on", "note: x"]
    assert capsys.readouterr().out.splitlines() == told
