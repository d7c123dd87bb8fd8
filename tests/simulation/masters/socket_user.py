"""A person at the gateway's own machine, who asks `control.sock` while masters work.

The socket itself is the kernel's; what it does with one line is called here, in the loop of the process that serves it.
Whatever the line holds: the answer is one JSON object that says whether it was done.
"""

import json
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from tests.simulation.kernel.virtual_time import VirtualLoop
from tests.simulation.masters.spelling import control_of

ASK_S = 0.5
"""Between two looks at a run that this person has started; nobody stops it meanwhile."""
LEFT_S = 3.2
"""Time after which a run that nobody looks at any more goes down by itself."""
MODEL_CHANGES = ("use", "rollback")
Answer = dict[str, Any]


class SocketUser:
    """on_write(control): a Modbus request was taken that came this way; on_model: another set may be in use from now on;
    on_tare: a run has begun that tares; complaints: broken answers. watched_s: when a run of this person's was looked at last,
    None where there is none."""

    watched_s: float | None = None

    def __init__(
        self, inside: Callable[[], VirtualLoop | None], answer: Callable[[bytes], bytes | Future[bytes]]
    ) -> None:
        self._inside, self._answer = inside, answer
        self.complaints: list[str] = []
        self.answers = 0
        self.on_write: Callable[[int | None], None] = lambda control: None
        self.on_pdu: Callable[[bytes, bool], None] = lambda pdu, is_answered: None
        self.on_model: Callable[[], None] = lambda: None
        self.on_tare: Callable[[], None] = lambda: None
        self._patience = self._run = 0

    def say(self, line: bytes) -> None:
        """Ask this, in the turn of the process that serves."""
        if (inside := self._inside()) is not None and inside.servers:
            inside.call_soon(self._hear, inside, line)

    def lose(self) -> None:
        """The process is gone, and what ran in it."""
        self.watched_s = None

    def _hear(self, inside: VirtualLoop, line: bytes) -> None:
        text = self._answer(line)
        if isinstance(text, Future):
            text.add_done_callback(lambda later: self._judge(inside, line, later.result()))
        else:
            self._judge(inside, line, text)

    def _judge(self, inside: VirtualLoop, line: bytes, text: bytes) -> None:
        try:
            answer = json.loads(text)
            is_done = bool(answer["ok"])
            assert is_done or answer["error"]
        except (ValueError, KeyError, TypeError, AssertionError):
            self.complaints.append(f"socket: {line!r} was answered {text!r}")
            return
        self.answers += 1
        if is_done:
            self._follow(inside, json.loads(line), answer)

    def _follow(self, inside: VirtualLoop, request: Answer, answer: Answer) -> None:
        match request["do"]:
            case "calibration" if any(request.get(name) is not None for name in MODEL_CHANGES):
                self.on_model()
            case "calibrate" if request.get("plan") is not None and not request.get("dry_run"):
                self._patience = int(request.get("name", "0") or 0)
                if request["plan"].get("tare"):
                    self.on_tare()
                self._watch(inside)
            case "calibrate" if answer.get("running") and self.watched_s is not None:
                self.watched_s = inside.time()  # a question is a look, too
            case "modbus" if int(answer["pdu"][:2], 16) < 0x80:
                self.on_pdu(bytes.fromhex(request["pdu"]), True)
                self.on_write(control_of(bytes.fromhex(request["pdu"])))

    def _watch(self, inside: VirtualLoop) -> None:
        """Look at the run as long as this person has patience."""
        self.watched_s = inside.time()
        self._run += 1
        inside.call_later(ASK_S, self._look, inside, self._run)

    def _look(self, inside: VirtualLoop, run: int) -> None:
        if inside is not self._inside() or self.watched_s is None or run != self._run:
            return
        if self._patience > 0:
            self._patience -= 1
            if not json.loads(self._answer(b'{"do": "calibrate"}')).get("running"):
                self.watched_s = None
                return
            self.watched_s = inside.time()
        elif inside.time() - self.watched_s > LEFT_S:
            self.watched_s = None
            return
        inside.call_later(ASK_S, self._look, inside, run)
