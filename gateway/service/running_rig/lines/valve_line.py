"""The valve's line: at most one question on the wire, and the direction is what is read back, ten times a second.

A setting goes out only while control allows it (no pressure is out) and the valve stands elsewhere; its answer moves nothing,
the reading after it does. Time comes in as an argument, so that tests run it in virtual time.
"""

from collections.abc import Callable, Sequence
from math import inf
from typing import Final

from gateway.control.inputs import ValveStatus, WireCounts
from gateway.devices import ValveDirection, ValveHost
from gateway.devices.messages import Garbage

_POLL_PERIOD_S: Final = 0.1


class ValveExchange:
    """Asks the device through `write`. status: what control is told; lost: its port is away; counts: since the start."""

    def __init__(self, host: ValveHost, write: Callable[[bytes], None], reply_timeout_s: float) -> None:
        self._host, self._write, self._reply_timeout_s = host, write, reply_timeout_s
        self.lost, self.counts = False, WireCounts()
        self._order: ValveDirection | None = None
        self.reset()

    def reset(self) -> None:
        """Forget all that was received before: the port has been opened (again)."""
        self._host.forget()
        self._host.said = ""
        self._stands: ValveDirection | None = None
        self._asked: ValveDirection | None = None
        self._told: ValveDirection | None = None
        self._sent_s = inf
        self._unanswered_since_s: float | None = None
        self._next_s = self._free_s = -inf

    @property
    def status(self) -> ValveStatus:
        """State of the valve's line now."""
        return ValveStatus(self._stands, self._unanswered_since_s, self.lost, self._host.said)

    def set_direction(self, order: ValveDirection | None, now_s: float) -> None:
        """Have the valve stand there; None leaves it where it is."""
        is_new, self._order = order is not None and order is not self._order, order
        if is_new:
            self._told = None
            self._next_s = now_s if order is not self._stands else self._next_s
        self._send_next(now_s)

    def on_bytes(self, chunk: bytes, now_s: float) -> Sequence[ValveDirection | Garbage]:
        """Return what these bytes complete, once it is acted on; what waits goes out."""
        replies = self._host.receive(chunk)
        for reply in replies:
            if isinstance(reply, Garbage):
                self.counts.garbled += 1
                continue
            self.counts.heard += 1
            if self._asked is None:
                self._stands = reply
                if self._order in (None, reply):  # else it may have refused to go there
                    self._host.said = ""
                self._next_s = now_s if self._is_untold else self._sent_s + _POLL_PERIOD_S
            else:
                self._next_s = now_s  # read back at once
            self._sent_s, self._unanswered_since_s = inf, None
            self._free_s = now_s + self._host.gap_s
        self._send_next(now_s)
        return replies

    def tick(self, now_s: float) -> None:
        """Give up waiting for an overdue answer and ask again; unanswered_since_s keeps the age of the silence."""
        if now_s - self._sent_s > self._reply_timeout_s:
            self._sent_s = inf  # the next one is due: this one was
        self._send_next(now_s)

    @property
    def _is_untold(self) -> bool:
        """An order that has not gone out since it was given."""
        return self._order is not None and self._order is not self._stands and self._told is not self._order

    def _send_next(self, now_s: float) -> None:
        if self.lost or self._sent_s < inf or now_s < max(self._next_s, self._free_s):
            return
        has_to_move = self._order is not None and self._stands is not None and self._order is not self._stands
        just_told = self._asked is not None
        self._asked = self._order if has_to_move and not just_told else None
        self._told = self._asked or self._told
        self._sent_s = now_s
        self.counts.asked += 1
        if self._unanswered_since_s is None:
            self._unanswered_since_s = now_s
        self._write(self._host.request(self._asked))
