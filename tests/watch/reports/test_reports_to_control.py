"""The watch's line to control: one question, one answer, and a control that is away or says nonsense harms nobody."""

import json
import socket
import threading
from pathlib import Path
from typing import Any

import pytest

from gateway.watch.watch_process import report_to_control


def answered(state: Path, answer: bytes) -> tuple[dict[str, Any], bytes]:
    """What the watch makes of this answer, and what control was sent."""
    heard = b""
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(state / "control.sock"))
        listener.listen(1)
        listener.settimeout(5.0)

        def serve() -> None:
            nonlocal heard
            caller, _ = listener.accept()
            with caller:
                heard = caller.recv(65536)
                caller.sendall(answer)

        control = threading.Thread(target=serve)
        control.start()
        told = report_to_control(state, {"cause": 12, "sentence": "friction"})
        control.join(5.0)
    return told, heard


def test_a_report_is_one_line_of_the_verb_and_its_answer_is_control_s(tmp_path: Path) -> None:
    told, heard = answered(tmp_path, b'{"plant": 3, "plant_since_s": 7.5}\n')
    assert told == {"plant": 3, "plant_since_s": 7.5}
    assert heard.endswith(b"\n") and heard.count(b"\n") == 1
    assert json.loads(heard) == {"do": "residual", "cause": 12, "sentence": "friction"}


@pytest.mark.parametrize("answer", [b"", b"[1, 2]\n", b"null\n", b'{"plant": \n', b"\xff\xfe\n"])
def test_an_answer_that_is_none_says_nothing(tmp_path: Path, answer: bytes) -> None:
    assert answered(tmp_path, answer)[0] == {}


def test_a_control_that_is_away_hears_it_the_next_time(tmp_path: Path) -> None:
    assert report_to_control(tmp_path, {"cause": 0}) == {}
    (tmp_path / "control.sock").touch()
    assert report_to_control(tmp_path, {"cause": 0}) == {}
