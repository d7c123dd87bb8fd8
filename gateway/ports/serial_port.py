"""One serial port on asyncio: owns opening, losing and reopening; bytes go by the raw descriptor.

pyserial's own read and write are not used in the loop: they would add a select per call and hide hang-ups. A read error, a
hang-up or a device that takes no bytes for too long all end in `on_lost` and a reopening with backoff; `on_open` comes again.
The lock binds only who asks for it: a terminal program that is started on the port sets its own speed, and often leaves it.
Nothing would come to the device any more, not even the safe voltage, so the settings are looked at and set again.
Only a simulated rig's pty that has lost its device is not looked for under its number, which may be another's by then:
`move` says where it is. Nothing written before a loss is sent after it: an old voltage is worse than none.
"""

import asyncio
import contextlib
import fcntl
import os
import select
import termios
from typing import Any, Final

from gateway.devices import SerialSettings
from gateway.ports.closing import Closing, queued_bytes
from gateway.ports.errors import SERIAL_FAILURES, PortError, explain_changed_settings, explain_loss, is_shortage
from gateway.ports.identity import PtyIdentity
from gateway.ports.latency import set_low_latency
from gateway.ports.opening import (
    Explain,
    TerminalSettings,
    explain_in_brief,
    explain_in_full,
    let_send,
    open_descriptor,
    restore_settings,
    settings_of,
)
from gateway.ports.port import CHUNK_BYTES, WRITE_DEADLINE_S, PortEvents, monotonic_s
from gateway.processes.disk_worker import DiskWorker

MOST_UNSENT_BYTES: Final = 4096  # beyond it the line is stuck: no command here is longer than 40 bytes
_DROPPED_BYTES: Final = 4096
_MOST_DROPPED_READS: Final = 32  # twice what a terminal keeps: who talks without end is not waited for
_FIRST_BACKOFF_S, _LONGEST_BACKOFF_S = 0.1, 2.0
_REFUSALS: Final = ("E101", "E103")  # permission, another program: somebody must do something; for a shortage as well
_REFUSALS_TOLD: Final = 3  # in a row: 0.6 s after the first
_CLOSE_DEADLINE_S: Final = 0.25
_LOOK_S: Final = 0.1  # at the settings: a microsecond


class SerialPort:
    """All callbacks of `events` run in the loop; on_lost is never called from inside `write`.

    is_simulated: a lost pty is not looked for under its number; `move` will tell where its device is from then on.
    """

    def __init__(self, path: str, settings: SerialSettings, events: PortEvents, *, is_simulated: bool = False) -> None:
        self._path = path
        self._settings = settings
        self._on_bytes, self._on_lost, self._on_open = events.on_bytes, events.on_lost, events.on_open
        self._on_refused, self._refusals = events.on_refused, 0
        self._on_restored = events.on_restored
        self._set_to: TerminalSettings = []
        self._look: asyncio.TimerHandle | None = None
        self._descriptor, self._closing = -1, Closing()
        self._is_wanted = False  # from `open` to `close`
        self._identity = PtyIdentity(is_kept=is_simulated)
        self._unsent = b""
        self._backoff_s = _FIRST_BACKOFF_S
        self._reopening: asyncio.TimerHandle | None = None
        self._failure: PortError | None = None  # found while writing, told in the loop's next turn
        self.warning = ""  # a sentence about the adapter's latency, empty if there is nothing to say

    @property
    def path(self) -> str:
        """Path of the port."""
        return self._path

    @property
    def is_open(self) -> bool:
        """Decide whether the port is open and works."""
        return self._descriptor >= 0 and self._failure is None

    @property
    def unsent_bytes(self) -> int:
        """Bytes that are not on the wire yet: ours and the driver's."""
        return len(self._unsent) + queued_bytes(self._descriptor) if self._descriptor >= 0 else 0

    async def open(self) -> None:
        """Open the port and keep it open from now on. PortError when it cannot be opened."""
        self._identity.take(self._path)
        try:
            self._open()
        except PortError:
            self._identity.release()
            raise
        self._is_wanted = True

    def begin_lost(self, failure: PortError) -> None:
        """Report a first opening that failed like any loss, and try again as after one."""
        self._identity.take(self._path)
        self._is_wanted = True
        self._reopen_after(self._backoff_s)
        self._on_lost(failure)

    def move(self, path: str) -> None:
        """Move to another path: the present port is given up, and the other opened at once."""
        was, self._path = self._path, path
        if not self._is_wanted or (path == was and self.is_open and not self._identity.is_gone):
            return
        self._lose(explain_loss(was, None))
        self._identity.take(path)
        self._stop_reopening()
        self._reopen()

    def write(self, data: bytes) -> bool:
        """Hand over bytes without waiting. False while the port is lost: nothing of before a loss is sent after it."""
        if not self.is_open:
            return False
        if self._unsent:
            self._keep(data)
            return self.is_open
        try:
            sent = os.write(self._descriptor, data)
        except BlockingIOError:
            sent = 0
        except OSError as error:
            self._fail(explain_loss(self._path, error))
            return False
        if sent < len(data):
            asyncio.get_running_loop().add_writer(self._descriptor, self._on_writable)
            self._keep(data[sent:])
        return self.is_open

    def read_arrived(self) -> None:
        """Hand over what has arrived and no turn of the loop has read: one that was late calls its timers first (uvloop)."""
        if self.is_open:
            self._on_readable()

    def flush_input(self) -> int:
        """Drop what has arrived and was not read yet; how many bytes that was."""
        dropped = 0
        try:  # no `suppress`: three objects on every setpoint's way to the wire
            for _ in range(_MOST_DROPPED_READS):
                if not (self.is_open and (chunk := os.read(self._descriptor, _DROPPED_BYTES))):
                    break
                dropped += len(chunk)
        except OSError:
            return dropped
        return dropped

    def drop_unsent(self) -> None:
        """Drop what was handed over and is not on the wire yet, as far as the driver lets us."""
        if not self.is_open:
            return
        asyncio.get_running_loop().remove_writer(self._descriptor)
        self._unsent = b""
        with contextlib.suppress(*SERIAL_FAILURES):  # the next read or write tells of what is gone
            termios.tcflush(self._descriptor, termios.TCOFLUSH)

    async def drain(self, deadline_s: float = WRITE_DEADLINE_S) -> None:
        """Wait until the driver has taken every byte. PortError after deadline_s."""
        end_s = monotonic_s() + deadline_s
        while (unsent := self._still_unsent()) and (left_s := end_s - monotonic_s()) > 0:
            await asyncio.sleep(min(left_s, max(1e-3, unsent * self._settings.character_s)))
        if unsent:
            raise PortError("E111", f"{self._path} takes no bytes: {unsent} unsent after {deadline_s:g} s")
        termios.tcdrain(self._descriptor)  # the driver's queue is empty: only the chip's own few bytes are left

    async def write_last(self, data: bytes, deadline_s: float = WRITE_DEADLINE_S) -> None:
        """Write data and wait until it is sent. PortError when it cannot be."""
        if not self.write(data):
            raise PortError("E102", f"{self._path} is not open")
        try:
            await self.drain(deadline_s)
        except SERIAL_FAILURES as error:
            raise explain_loss(self._path, error) from error

    def close(self) -> None:
        """Close the port. Blocks for at most 0.25 s, and only while bytes are on their way."""
        self._is_wanted = False
        self._stop_reopening()
        self._identity.release()
        if self._descriptor >= 0:
            with contextlib.suppress(*SERIAL_FAILURES):
                self._send_the_rest(monotonic_s() + _CLOSE_DEADLINE_S)
            self._release()

    def _open(self, explain: Explain = explain_in_full) -> None:
        descriptor = open_descriptor(self._path, self._settings, explain)
        try:
            self._set_to = settings_of(descriptor)
        except SERIAL_FAILURES as error:  # gone again: a plug that bounces
            os.close(descriptor)
            raise explain(self._path, error) from error
        self._descriptor = descriptor
        self._failure, self._backoff_s, self._refusals = None, _FIRST_BACKOFF_S, 0
        self.warning = set_low_latency(self._descriptor, self._path)
        asyncio.get_running_loop().add_reader(self._descriptor, self._on_readable)
        self._look = asyncio.get_running_loop().call_later(_LOOK_S, self._look_at_settings)
        try:
            self._on_open(self._descriptor)
        except PortError:
            self._release()
            raise

    def _look_at_settings(self) -> None:
        self._look = asyncio.get_running_loop().call_later(_LOOK_S, self._look_at_settings)
        with contextlib.suppress(*SERIAL_FAILURES):  # the next read tells of what is gone
            let_send(self._descriptor)
            if settings_of(self._descriptor) == self._set_to:
                return
            change = explain_changed_settings(self._path)
            if restore_settings(self._descriptor, self._set_to, self._settings.baud):
                self._on_restored(change)
            else:
                self._lose(change)

    def _on_readable(self) -> None:
        try:
            chunk = os.read(self._descriptor, CHUNK_BYTES)
        except BlockingIOError:
            return
        except OSError as error:
            self._lose(explain_loss(self._path, error))
            return
        if chunk:
            self._on_bytes(chunk, monotonic_s())
        else:
            self._lose(explain_loss(self._path, None))

    def _on_writable(self) -> None:
        try:
            self._unsent = self._unsent[os.write(self._descriptor, self._unsent) :]
        except BlockingIOError:
            return
        except OSError as error:
            self._lose(explain_loss(self._path, error))
            return
        if not self._unsent:
            asyncio.get_running_loop().remove_writer(self._descriptor)

    def _keep(self, data: bytes) -> None:
        self._unsent += data
        if len(self._unsent) > MOST_UNSENT_BYTES:
            self.drop_unsent()  # the driver's part of it would outlast the loss, and be sent after it
            self._fail(PortError("E111", f"{self._path} takes no bytes: more than {MOST_UNSENT_BYTES} unsent"))

    def _fail(self, failure: PortError) -> None:
        self._failure = failure
        asyncio.get_running_loop().call_soon(self._lose_if_failed, failure)

    def _lose_if_failed(self, failure: PortError) -> None:
        """Not what has been opened elsewhere since."""
        if self._failure is failure:
            self._lose(failure)

    def _lose(self, failure: PortError) -> None:
        if self._descriptor < 0:
            return
        self._release()
        self._reopen_after(self._backoff_s)
        self._on_lost(failure)

    def _release(self) -> None:
        loop = asyncio.get_running_loop()
        loop.remove_reader(self._descriptor)
        loop.remove_writer(self._descriptor)
        if self._look:
            self._look.cancel()
        with contextlib.suppress(OSError):  # the guardian has the same open file, and with it the lock: give it back
            fcntl.flock(self._descriptor, fcntl.LOCK_UN)
        self._closing.close(self._descriptor)
        self._descriptor, self._unsent = -1, b""

    def _reopen_after(self, delay_s: float) -> None:
        self._reopening = asyncio.get_running_loop().call_later(delay_s, self._reopen)

    def _stop_reopening(self) -> None:
        if self._reopening:
            self._reopening.cancel()
            self._reopening = None

    def _reopen(self) -> None:
        self._reopening = None
        if self._identity.is_gone:
            return
        if self._closing.is_pending:
            self._reopen_after(self._backoff_s)
            return
        try:
            self._open(explain_in_brief)
        except PortError as error:
            self._backoff_s = min(2.0 * self._backoff_s, _LONGEST_BACKOFF_S)
            self._reopen_after(self._backoff_s)
            self._note_refusal(error)

    def _note_refusal(self, error: PortError) -> None:
        """It is there again and does not open: told once, and not at the first time, for udev gives permissions a moment after
        the name."""
        is_refused = error.code in _REFUSALS or is_shortage(error.__cause__)
        self._refusals = self._refusals + 1 if is_refused else 0
        if self._refusals == _REFUSALS_TOLD and isinstance(error.__cause__, Exception):
            self._tell_refusal(self._path, error.__cause__)

    def _tell_refusal(self, path: str, error: Exception) -> None:
        """In a thread: on a machine with a desktop's ten thousand open files it took 0.2 s until it was known who holds a port,
        and a control loop that stands still so long is killed for it."""

        def tell(refusal: Any) -> None:
            if self._is_wanted and self._refusals:  # else it has been opened, or is away, by now
                self._on_refused(refusal if isinstance(refusal, PortError) else explain_in_brief(path, error))

        asking = DiskWorker()
        asking(lambda: explain_in_full(path, error), tell)
        asking.close()

    def _still_unsent(self) -> int:
        if not self.is_open:
            raise PortError("E102", f"{self._path} was lost while bytes were on their way")
        return self.unsent_bytes

    def _send_the_rest(self, end_s: float) -> None:
        while self._unsent and (left_s := end_s - monotonic_s()) > 0:
            if select.select([], [self._descriptor], [], left_s)[1]:
                self._unsent = self._unsent[os.write(self._descriptor, self._unsent) :]
        while queued_bytes(self._descriptor) and (left_s := end_s - monotonic_s()) > 0:
            select.select([], [], [], min(left_s, 1e-3))
        if not queued_bytes(self._descriptor):
            termios.tcdrain(self._descriptor)
