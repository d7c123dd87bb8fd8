"""What verbs ask a running gateway for: what it refuses is told, what another has asked for is not waited for."""

import fcntl
import json
import socket
import threading
from pathlib import Path
from typing import Any

import pytest

from gateway.cli import change_in_use, control_socket
from gateway.cli.calibration import store_access
from gateway.cli.change_in_use import ask_until_done, not_running
from gateway.cli.errors import CliError
from gateway.processes import exit_codes
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
            store_access.change(tmp_path, "demo", {"use": 2})
    assert failed.value.exit_code == code


def test_two_that_change_what_is_in_use_are_not_both_alone(tmp_path: Path) -> None:
    with not_running(tmp_path) as is_first_free, not_running(tmp_path) as is_second_free:
        assert (is_first_free, is_second_free) == (True, False)


def test_the_service_may_take_as_long_to_stop_as_a_ramp_does() -> None:
    """systemd would else kill it while the tool still presses."""
    from gateway.cli.system_service.unit_file import STOP_S

    assert STOP_S >= STOP_BOUND_S + 5.0
