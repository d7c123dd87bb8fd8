"""A program that uses the generated client of C as its head says: one exchange a cycle, in virtual time, no socket.

What the client asks of its system goes to functions of the test, by macros before its only include: the library around it is
compiled once a run.
"""

import ctypes
import re
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from tests.clients.gateway_at_hand import GatewayAtHand, Unplugged

GLUE = Path(__file__).with_name("c_program_glue.c")
OK, LOST, RANGE, WORKING = 0, 2, 3, 5  # what its functions return
SILENT = 2  # what answers a connection that nobody accepts nor refuses: a machine that is off
ANSWER = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.POINTER(ctypes.c_uint8), ctypes.c_int, ctypes.POINTER(ctypes.c_uint8))
ACCEPT = ctypes.CFUNCTYPE(ctypes.c_int)
RANGES = ("range_low", "range_high", "force_low", "force_high", "blend_span")
LISTS = ("rising_b", "rising_w", "falling_b", "falling_w")


@cache
def library_of(text: str) -> Any:
    """The client as a library; the test is skipped where nothing compiles C."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler")
    with tempfile.TemporaryDirectory() as folder:
        where = Path(folder)
        (where / "force_gateway.h").write_text(text, encoding="utf-8")
        options = ["-shared", "-fPIC", "-O1", "-I", folder, "-o", str(where / "client.so")]
        subprocess.run([compiler, *options, str(GLUE), "-lm"], check=True)
        library = ctypes.CDLL(str(where / "client.so"))
    for name in ("message", "fault", "fg_test_result_text", "fg_test_item_text", "fg_verdict_text"):
        getattr(library, name).restype = ctypes.c_char_p
    for name in ("make", "make_model"):
        getattr(library, name).restype = ctypes.c_void_p
    library.time_ms.restype, library.force_measured.restype = ctypes.c_longlong, ctypes.c_float
    return library


class CProgram:
    """text: what people would be shown: of the last refusal, loss or fault."""

    def __init__(self, text: str, gateway: GatewayAtHand) -> None:
        self._library = library_of(text)
        self.gateway, self.now_s, self.text, self.uploaded = gateway, 0.0, "", False
        unit = int(re.findall(r"fg_init\(&gateway, .*, (\d+)\);", text)[0])
        self._client = ctypes.c_void_p(self._library.make(unit))
        self._answer, self._accept = ANSWER(self._ask), ACCEPT(self._connect)
        self._allowed_n = tuple(map(float, re.findall(r"force_n [<>]= (\S+)f", text)))
        self._upload: tuple[Any, int] | None = None
        self._is_committing = self.is_silent = False
        self.found: dict[str, str] = {}

    def _ask(self, frame: Any, count: int, answer: Any) -> int:
        try:
            data = self.gateway.ask(bytes(frame[:count]))
        except Unplugged:
            return 0
        except ConnectionResetError:
            return -1
        ctypes.memmove(answer, data, len(data))
        return len(data)

    def _connect(self) -> int:
        try:
            self.gateway.connect()
        except Unplugged:
            return SILENT if self.is_silent else 0
        return 1

    def send_signals(self, count: int) -> None:
        """Let so many signals come while the program waits the next time."""
        self._library.send_signals(count)

    def enable(self, force_n: float) -> None:
        self.text = ""
        self._ask_for(self._library.fg_enable, force_n)

    def force(self, force_n: float) -> None:
        self._ask_for(self._library.fg_force, force_n)

    def _ask_for(self, act: Any, force_n: float) -> None:
        if act(self._client, ctypes.c_float(force_n)) == RANGE:
            self.text = "allowed {:.2f} .. {:.2f}".format(*self._allowed_n)

    def disable(self) -> None:
        self._library.fg_disable(self._client)

    def reset(self) -> None:
        self._library.fg_reset_fault(self._client)

    def tare(self) -> None:
        self._library.fg_tare(self._client)

    def pull(self, *, pulls: bool) -> None:
        self._library.fg_pull(self._client, int(pulls))

    def self_test(self) -> None:
        self.text, self.found = "", {}
        self._library.fg_self_test(self._client)

    def end_self_test(self) -> None:
        self._library.fg_disable(self._client)

    @property
    def is_testing(self) -> bool:
        return bool(self._library.fg_is_testing(self._client))

    def _read_self_test(self) -> int:
        words = (ctypes.c_uint16 * 64)()
        result = int(self._library.fg_read_self_test(self._client, words))
        if result == OK:
            items = {self._library.fg_test_item_text(k).decode(): k for k in range(64)}
            say = self._library.fg_verdict_text
            self.found = {"result": self._library.fg_test_result_text(words[0]).decode()}
            self.found["leak"] = say(words[items["leak"]]).decode()
            self.text = f"self-test {self.found['result']}"
        return result

    def begin_upload(self, model: dict[str, Any], slot: int) -> None:
        made = ctypes.c_void_p(self._library.make_model())
        lists = [value for name in LISTS for value in (*model[name], *[0.0] * (16 - len(model[name])))]
        numbers = (ctypes.c_float * 64)(*lists), (ctypes.c_float * 5)(*(model[name] for name in RANGES))
        self._library.set_model(made, model["order"], *numbers)
        self._upload = made, slot

    def cycle(self, seconds: float = 0.04) -> None:
        self.now_s += seconds
        had_ended, was_testing = self.ended, self.is_testing
        self._library.use(self._answer, self._accept, round(self.now_s * 1e3))
        result = self._library.fg_exchange(self._client)
        if result == OK and self._upload:
            result, self._upload, self._is_committing = self._stage(*self._upload), None, True
        elif result == OK and self._is_committing:
            result = self._await_commit()
        if result == OK and was_testing and not self.is_testing:
            result = self._read_self_test()
        self.now_s = self._library.time_ms() / 1e3
        if result != OK:
            self.text = "lost: " * (result == LOST) + self._library.message(self._client).decode()
        elif fault := self._library.fault(self._client).decode():
            self.text = fault
        elif self.ended and not had_ended:
            self.text = "disabled by the gateway or another master"

    def _stage(self, model: Any, slot: int) -> int:
        result = int(self._library.fg_stage(self._client, model, slot))
        return int(self._library.fg_commit(self._client)) if result == OK else result

    def _await_commit(self) -> int:
        result = int(self._library.fg_commit_state(self._client))
        self._is_committing, self.uploaded = result == WORKING, result == OK
        return OK if result == WORKING else result

    @property
    def enabled(self) -> bool:
        return bool(self._library.is_enabled(self._client))

    @property
    def in_band(self) -> bool:
        return bool(self._library.is_in_band(self._client))

    @property
    def ended(self) -> bool:
        return bool(self._library.has_ended(self._client))

    @property
    def force_measured_n(self) -> float:
        return float(self._library.force_measured(self._client))
