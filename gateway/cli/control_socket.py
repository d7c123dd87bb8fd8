"""Asks the running gateway on this machine something that Modbus has no register for: one JSON line, one answer."""

import json
import re
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from gateway.cli.errors import CliError, NoAnswerError
from gateway.processes import exit_codes
from gateway.processes.json_socket.messages import LONGEST_ANSWER, why_path_too_long
from gateway.processes.state_directory import CONTROL_SOCKET

_TIMEOUT_S: Final = 2.0
_HAS_CODE: Final = re.compile(r"E\d{3} ")


def ask(state: Path, request: dict[str, Any], socket_name: str = CONTROL_SOCKET) -> dict[str, Any]:
    """Return the answer of the gateway that runs on this state directory; CliError when there is none or it refuses, and as
    NoAnswerError where it was there and may have done what it was asked for."""
    path = state / socket_name
    if why := why_path_too_long(path):  # a gateway may run there, which has said the same at its start
        raise CliError(f"E152 {path} is served by no gateway: {why}, to it and here", exit_codes.DEVICE)
    kind = CliError

    def note_asked() -> None:
        nonlocal kind
        kind = NoAnswerError

    try:
        answer = _exchange(path, json.dumps(request).encode() + b"\n", note_asked)
    except PermissionError:
        raise CliError(f"E105 {path}: belongs to the user who runs the gateway", exit_codes.PERMISSION) from None
    except (OSError, ValueError) as error:
        raise kind(
            f"E140 no gateway answers on {path} ({getattr(error, 'strerror', None) or error}); "
            "is it running, with the same --state or rig?",
            exit_codes.DEVICE,
        ) from None
    if not answer.pop("ok", False):
        sentence = str(answer.get("error", "the gateway refused without a reason"))
        raise CliError(sentence if _HAS_CODE.match(sentence) else f"E141 {sentence}")
    return answer


def _exchange(path: Path, line: bytes, on_asked: Callable[[], None]) -> dict[str, Any]:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as link:
        link.settimeout(_TIMEOUT_S)
        link.connect(str(path))
        on_asked()
        link.sendall(line)
        with link.makefile("rb") as stream:
            answer = json.loads(stream.readline(LONGEST_ANSWER) or b"null")
    if not isinstance(answer, dict):
        raise ValueError("no answer")
    return answer
