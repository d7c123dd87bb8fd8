"""HTTP of the page and of the metrics: a connection that does not come to a whole request in time is closed, and one that
takes nothing of its answer; where as many are open as are served, of such the one that asked longest ago makes room.

uvicorn waits for ever for the rest of a request, and for an answer to be taken. While its bound of connections is full it
refuses everybody. So whoever opened as many and said nothing, or read nothing, shut out all others, and the page's Stop with
them: for as long as it liked, and without the page's token.
"""

import asyncio
from typing import Final

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

WHOLE_REQUEST_S: Final = 10.0
"""From its first byte, or from the connection. The largest request that is taken has 64 KB."""
UNREAD_S: Final = 30.0
"""For a browser that is asleep, and a page that it has frozen: it comes back by itself."""


class BoundedHttpProtocol(H11Protocol):
    """One connection."""

    _request_timer: asyncio.TimerHandle | None = None
    _unread_timer: asyncio.TimerHandle | None = None
    _asked_s = 0.0  # when it connected, or its last whole request had come

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]  # as uvicorn has it
        """Begin to wait for a request."""
        super().connection_made(transport)
        self._asked_s = self.loop.time()
        self._make_room()
        self._watch_request()

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait for nothing any more."""
        super().connection_lost(exc)
        self._end_request_timer()
        self._end_unread_timer()

    def pause_writing(self) -> None:
        """Begin to wait until some of what was sent is taken."""
        super().pause_writing()
        self._end_unread_timer()
        self._unread_timer = self.loop.call_later(UNREAD_S, self.transport.abort)

    def resume_writing(self) -> None:
        """End that wait."""
        super().resume_writing()
        self._end_unread_timer()

    def data_received(self, data: bytes) -> None:
        """Take the next bytes."""
        super().data_received(data)
        self._watch_request()

    def send_400_response(self, msg: str) -> None:
        """Answer what is no HTTP, where an answer may still be given, and hang up. uvicorn gives one in any case: behind
        another, or with a body to HEAD; and the application answers as well. To anybody's bad chunk these were errors of this
        program, with a page of its log each."""
        waits = self.conn.our_state is h11.SEND_RESPONSE
        if self.cycle is not None and not self.cycle.response_complete:
            self.cycle.disconnected = True
            self.cycle.message_event.set()
        if self.conn.our_state is h11.IDLE or (waits and self.scope["method"] != "HEAD"):
            super().send_400_response(msg)
        else:
            self.transport.close()

    def _should_upgrade(self) -> bool:
        """There is no other protocol: an offer may be passed over (RFC 9110, 7.8), and uvicorn would ask for a library."""
        return False

    def _watch_request(self) -> None:
        """More of the same request does not begin the time anew."""
        if not self._is_waited_for:
            self._asked_s = self.loop.time()
            self._end_request_timer()
        elif self._request_timer is None:
            self._request_timer = self.loop.call_later(WHOLE_REQUEST_S, self.transport.close)

    @property
    def _is_waited_for(self) -> bool:
        """Decide whether its next request, or the rest of one, is still to come."""
        return self.conn.their_state in (h11.IDLE, h11.SEND_BODY)

    @property
    def _keeps_others_waiting(self) -> bool:
        """Decide whether nothing comes of it but by its caller, who has asked for nothing, or takes nothing."""
        return self._is_waited_for or self._unread_timer is not None

    def _make_room(self) -> None:
        if self.limit_concurrency is None or len(self.connections) < self.limit_concurrency:
            return
        silent = [
            one
            for one in self.connections
            if isinstance(one, BoundedHttpProtocol) and one._keeps_others_waiting and one != self
        ]
        if silent:
            longest = min(silent, key=lambda one: one._asked_s)
            self.connections.discard(longest)  # now: several may come before it is told of its end
            longest.transport.abort()

    def _end_request_timer(self) -> None:
        patience, self._request_timer = self._request_timer, None
        if patience:
            patience.cancel()

    def _end_unread_timer(self) -> None:
        unread, self._unread_timer = self._unread_timer, None
        if unread:
            unread.cancel()
