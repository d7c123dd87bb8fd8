"""What a load cell has said since its last reading that nobody could read: then it is not silent, and its wires are well."""

from collections.abc import Sequence
from math import inf
from typing import Final

from gateway.devices import DeviceProfile
from gateway.devices.messages import Garbage
from gateway.devices.template_codecs.unread_line import explain_unread

_LEAST: Final = 2  # one may be what a cut or the opening of the port has left of a line
_RECENT_S: Final = 1.0


class UnreadLines:
    """Hears what the codec makes of the bytes, in their order."""

    def __init__(self, profile: DeviceProfile) -> None:
        self._profile = profile
        self._explained, self._explanation = b"", ""
        self.forget()

    def forget(self) -> None:
        """Begin anew: another device may be behind the port."""
        self._count, self._last, self._last_s = 0, b"", -inf

    def hear(self, messages: Sequence[object], now_s: float) -> None:
        """Keep the newest that is not understood; one that is begins anew."""
        for message in messages:
            if isinstance(message, Garbage):
                self._count, self._last, self._last_s = self._count + 1, message.data, now_s
            else:
                self._count = 0

    def words(self, now_s: float) -> str:
        """Return what the device says in place of readings, and what to do; empty where it says nothing that is text."""
        if self._count < _LEAST or now_s - self._last_s > _RECENT_S:
            return ""
        return self.explain(self._last)

    def explain(self, line: bytes) -> str:
        """Return what one line says that was not understood, and what to do; empty where it is no text. Asked at each decision,
        and looked for once: a frame in noise took a millisecond of each."""
        if line != self._explained:
            self._explained, self._explanation = line, explain_unread(self._profile, line)
        return self._explanation
