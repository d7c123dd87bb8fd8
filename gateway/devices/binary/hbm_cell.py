"""Both ends of the line from an HBM AED or FIT amplifier with binary output: two or four bytes, then CR LF.

The measured value may contain the bytes of CR and LF, so they mark no end: the bytes of an answer are counted (AD104 operating
instructions, sections 6.3 and 6.4: formats COF0, COF2, COF4, COF6, COF8, COF12). A frame is a value with CR LF where its
length puts them; where they are elsewhere, bytes are dropped one by one until they fit, so a stream that was begun in the
middle costs a frame. `frame` of the profile names the format: {force:int32} COF0 and COF8, {force:int16} COF2, and with
-cdab their byte-swapped forms COF4 and COF12, COF6. Of four bytes the lowest is a status or 0: the value is the upper three.
"""

import re
import struct
from math import copysign, isfinite
from typing import Final

from gateway.devices.fields import RegisterNumber
from gateway.devices.force_reading import FORCE
from gateway.devices.messages import ForceSample, Garbage, Quality, RepeatedSample
from gateway.devices.profile import DeviceProfile
from gateway.devices.template_codecs.cell import TemplateCellDevice, TemplateCellHost

_END: Final = b"\r\n"
_TEXT: Final = re.compile(rb"[ -~]+")
"""Of an answer as ASCII (COF3), `+0012345`, the last four digits would be a value, the same at any force; so of any line."""
_STATUS_BITS: Final = 8  # the lowest byte of four


class _Format:
    """Layout of a value: size in bytes, order, bits below it that are no part of it."""

    def __init__(self, profile: DeviceProfile) -> None:
        number = profile.reading.template.field(FORCE)
        if not isinstance(number, RegisterNumber) or number.kind not in ("int16", "int32"):
            raise ValueError("codec hbm-binary: frame is {force:int32} (COF0, COF8) or {force:int16} (COF2)")
        self.code = ("<" if number.is_low_first else ">") + ("h" if number.kind == "int16" else "i")
        self.shift = 0 if number.kind == "int16" else _STATUS_BITS
        self.size = struct.calcsize(self.code)

    def decode(self, data: bytes) -> int:
        (value,) = struct.unpack(self.code, data)
        return int(value) >> self.shift

    def encode(self, value: int) -> bytes:
        most = (1 << (8 * self.size - self.shift - 1)) - 1
        return struct.pack(self.code, max(-most, min(most, value)) << self.shift) + _END


class HbmCellHost(TemplateCellHost):
    """See roles.CellHost."""

    def __init__(self, profile: DeviceProfile, sign: int = 1, unit: str | None = None) -> None:
        super().__init__(profile, sign, unit)
        self._format = _Format(profile)
        self._buffer, self._before = b"", b""  # _before: what was dropped last, ahead of what is kept

    def forget(self) -> None:
        """Drop half a value."""
        self._buffer, self._before = b"", b""

    def receive(self, chunk: bytes, now_s: float) -> list[ForceSample | Garbage | RepeatedSample]:
        """Return the samples and the garbage that these bytes complete, without our own words, which an adapter may hear."""
        self._buffer += chunk
        size, dropped = self._format.size + len(_END), b""
        found: list[ForceSample | Garbage | RepeatedSample] = []
        while len(self._buffer) >= size:
            if self._asked and self._buffer.startswith(self._asked):
                self._buffer = self._buffer[len(self._asked) :]
                continue
            if self._asked.startswith(self._buffer):
                break
            if not self._buffer[:size].endswith(_END):
                dropped, self._buffer = dropped + self._buffer[:1], self._buffer[1:]
                self._before = dropped[-1:]
                continue
            value, self._buffer = self._buffer[: self._format.size], self._buffer[size:]
            before, self._before = self._before, b""
            if before and _TEXT.fullmatch(before + value):
                dropped += value + _END
                continue
            found += [Garbage(dropped)] if dropped else []
            raw, dropped = float(self._format.decode(value)), b""
            found.append(ForceSample(raw, self._newtons(raw, {}), self._quality(raw, {}), now_s))
        return [*found, Garbage(dropped)] if dropped else found


class HbmCellDevice(TemplateCellDevice):
    """See roles.CellDevice."""

    def __init__(self, profile: DeviceProfile, unit: str | None = None) -> None:
        super().__init__(profile, unit)
        self._format = _Format(profile)

    def frame(self, force_n: float, quality: Quality = Quality.OK) -> bytes:
        """Return one measured value; beyond its range it stands at its end."""
        raw = force_n / self._newton_per_unit + self._reading.zero_count
        if quality is Quality.OVERLOAD or not isfinite(raw):
            raw = copysign(self._reading.largest_shown, raw)
        return self._format.encode(round(raw))
