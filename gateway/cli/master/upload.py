"""The master of an upload: sends the requests, waits for the outcome with a bound, reads the active set back.

On a serial line noise may take a request or its answer. Reading and staging may be done twice, so they are repeated; whether a
commit without an answer was heard, commit_status and the active block tell.
"""

import struct
import time
from typing import Any, Final

from gateway import defaults
from gateway.cli.errors import CliError, disk_hangs
from gateway.cli.master.client import Frame, GatewayClient
from gateway.cli.master.refusal_text import explain_refusals
from gateway.cli.master.upload_frames import Request, UploadFrames
from gateway.cli.master.wires import SilentLineError
from gateway.modbus.pdu import WRITE_REGISTER
from gateway.processes import exit_codes
from gateway.registers.upload.coefficients import HEAD_WORDS, TAIL_FROM
from gateway.registers.words import CommitNotice, CommitStatus, UploadReason

_OURS: Final = (UploadReason.STORAGE, UploadReason.DEFECT)
_PATIENCE_S = defaults.COMMIT_PATIENCE_S
_POLL_S: Final = 0.01
_REPEATS: Final = 3
_PLACES: Final = (
    "rising handle", "rising weight", "falling handle", "falling weight", "slip radius", "slip share", "response",
)  # fmt: skip
_RESPONSE: Final = ("dead time", "lag", "second lag", "damping")


class UploadClient(GatewayClient):
    """CliError for whatever goes wrong: no answer (69), a refusal (1), a set that fails a check (65)."""

    is_commit_sent = False

    def send(self, upload: UploadFrames, slot: int) -> None:
        """Send the requests in order. CliError when one is refused."""
        for request in upload.staging:
            self._send(request)
        self._commit(upload, slot)

    def _commit(self, upload: UploadFrames, slot: int) -> None:
        """Send the commit; again only where it has not been heard."""
        before = self._commit_status(upload)
        for is_last in (*[False] * _REPEATS, True):
            self.is_commit_sent = True
            try:
                self._send(upload.commit, repeats=0)
            except SilentLineError:
                if is_last:
                    raise
                if self._was_heard(upload, slot, before):
                    return
            else:
                return

    def _was_heard(self, upload: UploadFrames, slot: int, before: int) -> bool:
        """Decide whether the commit has begun. Where the status has not changed, only the set in use tells; a check and a
        commit that failed change nothing, and may be done again."""
        status = self._commit_status(upload)
        return status != before or (status == CommitStatus.COMMITTED and not self._difference(upload, slot))

    def _commit_status(self, upload: UploadFrames) -> int:
        with explain_refusals(self):
            return self.read_words(upload.poll.address, 1)[0]

    def _send(self, request: Request, repeats: int = _REPEATS) -> None:
        with explain_refusals(self, [Frame(request.address, request.words)]):
            if request.function == WRITE_REGISTER:
                text, words = f"write 1 at {request.address}", request.words[0]
                self._ask("write_register", text, request.address, words, repeats=repeats)
            else:
                text, several = f"write {len(request.words)} at {request.address}", list(request.words)
                self._ask("write_registers", text, request.address, several, repeats=repeats)

    def _ask(self, method: str, request: str, *arguments: Any, repeats: int = _REPEATS, **options: Any) -> Any:
        """Ask, and ask again where a serial line stays silent."""
        for _ in range(repeats):
            try:
                return super()._ask(method, request, *arguments, **options)
            except SilentLineError:
                continue
        return super()._ask(method, request, *arguments, **options)

    def calibration_id(self) -> int:
        """Read the number of the calibration in use."""
        with explain_refusals(self):
            return int(self.read_values([self.register_map.find("calibration_id")])[0].value)

    def outcome(self, upload: UploadFrames) -> CommitStatus:
        """Return how it ended: idle after a dry run, or committed. CliError when it failed."""
        deadline_s = time.monotonic() + _PATIENCE_S
        while True:
            with explain_refusals(self):
                words = self.read_words(upload.poll.address, upload.poll.count)
            status, index, reason = struct.unpack(">HhH", struct.pack(">3H", *words))
            if status == CommitStatus.FAILED:
                raise self._failure(index, reason)
            if status in (CommitStatus.IDLE, CommitStatus.COMMITTED):
                return CommitStatus(status)
            if time.monotonic() > deadline_s:
                name = CommitStatus(status).name.lower()
                raise disk_hangs(f"after {_PATIENCE_S:g} s the gateway is still {name}")
            time.sleep(_POLL_S)

    def is_known_set(self) -> bool:
        """Return whether the gateway knew the committed set already, so that number and name are the old ones."""
        with explain_refusals(self):
            (word,) = self.read_words(self.register_map.find("commit_notice").address, 1)
        return bool(word & CommitNotice.KNOWN_SET)

    def check_active(self, upload: UploadFrames, slot: int) -> None:
        """Check that the active block holds what was sent, word for word."""
        if where := self._difference(upload, slot):
            raise CliError(
                f"E434 committed, but another set is in use now ({where}): probably another master's; agree on one"
            )

    def _difference(self, upload: UploadFrames, slot: int) -> str:
        """Return where the set in use differs from what was sent; empty where it does not."""
        expected = struct.unpack(f">{len(upload.set_words) // 2}H", upload.set_words)
        first = self.register_map.find("order@active").address
        places = [*range(first, first + HEAD_WORDS)]
        places += range(first + TAIL_FROM, first + TAIL_FROM + len(expected) - HEAD_WORDS)
        with explain_refusals(self):
            words = self.read_words(first, HEAD_WORDS)
            words += self.read_words(first + TAIL_FROM, len(expected) - HEAD_WORDS)
            (active,) = self.read_words(self.register_map.find("active_slot").address, 1)
        different = [at for at, own, held_words in zip(places, expected, words, strict=True) if own != held_words]
        if different:
            return f"{len(different)} words differ, the first at {different[0]}"
        return "" if active == slot else f"slot {active}"

    def _failure(self, index: int, reason: int) -> CliError:
        unchanged = f"active set {self.calibration_id()} unchanged"
        if reason in _OURS:
            return CliError(f"E431 the gateway could not store the set, its log says why; {unchanged}")
        name = self.register_map.find("failing_reason").values.get(reason, f"reason {reason}").replace("_", " ")
        return CliError(f"E401 {place(index)}: {name}; {unchanged}", exit_codes.DATA)


def place(index: int) -> str:
    """Return failing_index in words: `index 50, falling weight 2`."""
    if not 0 <= index < 16 * len(_PLACES):
        return "the whole set"
    name = f"{_PLACES[index // 16]} {index % 16}"
    return f"index {index}, {_RESPONSE[index - 96] if 96 <= index < 96 + len(_RESPONSE) else name}"
