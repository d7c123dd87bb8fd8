"""The audit of one running rig: what watches its bank and its control socket, and the way from there to the disk."""

import time
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from pathlib import Path
from typing import Any, Final

from gateway.audit.audit_file import AuditFile
from gateway.audit.audit_log import AuditLog
from gateway.audit.write_audit import WriteAudit
from gateway.registers import RegisterBank

Handler = Callable[[dict[str, Any]], Any]
_CHANGING: Final = ("record", "calibration", "plant", "calibrate", "sim")
"""Verbs of the control socket that change something when they carry more than the verb."""


class RigAudit:
    """Made with the rig, begun by `watch`; put `flush` into each tick."""

    def __init__(
        self, state: Path, log: Callable[[str, str], None], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._log = AuditLog(AuditFile(state), log, clock, time.time)
        self._writes = WriteAudit(self._log.put, clock)
        self.note_gateway = self._writes.note_gateway

    def watch(self, bank: RegisterBank) -> None:
        """Have this bank tell of its writes."""
        bank.on_write = self._writes.note_command
        bank.on_refused_write = self._writes.note_refusal
        bank.staging.on_act = self._writes.note_act

    def watch_handlers(self, handlers: Mapping[str, Handler]) -> dict[str, Handler]:
        """Return the handlers of a control socket, those that change something told of."""
        return {
            verb: self._watched(verb, handler) if verb in _CHANGING else handler for verb, handler in handlers.items()
        }

    def note_failure(self, what: str, sentence: str) -> None:
        """Keep that what was accepted came to nothing. sentence: why, with its code."""
        self.note_gateway(what, result=sentence[:4], text=sentence.partition("\n")[0])

    def flush(self) -> None:
        """Send on what waits; cheap where nothing does."""
        self._writes.flush()
        self._log.flush()

    async def close(self) -> None:
        """Tell what was only counted, and write all, unless the disk takes nothing for a second."""
        self._writes.close()
        self._writes.note_gateway("end")
        await self._log.close()

    def _watched(self, verb: str, handler: Handler) -> Handler:
        def watched(request: dict[str, Any]) -> Any:
            if len(request) < 2 or request.get("dry_run"):
                return handler(request)
            try:
                answer = handler(request)
            except (ValueError, OSError) as error:
                self._writes.note_local(verb, request, str(error))
                raise
            if isinstance(answer, Future):
                answer.add_done_callback(lambda done: note(request, done))
            else:
                self._writes.note_local(verb, request, "accepted")
            return answer

        def note(request: dict[str, Any], done: Future[Any]) -> None:
            self._writes.note_local(verb, request, str(done.exception() or "accepted"))

        return watched
