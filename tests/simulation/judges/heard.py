"""What other output devices than the regulator of the demo rig are told, read off their wire as their manuals have it.

Shares no code with the gateway, as the observer does not.
"""

import re
from dataclasses import dataclass, field
from functools import lru_cache
from struct import unpack_from

from tests.simulation.judges.observer import Observer


@dataclass(frozen=True)
class Sentences:
    """setting: with the number as its only group, of which one is so many volts; others: whatever else may be said; end: of
    each sentence. Neither stands in the other."""

    end: bytes
    setting: bytes
    others: bytes
    volt: float = 1.0


DCON = rb"[$~]01[0-9A-Z]*|~\*\*"
SENTENCES = {
    "icpdas-702x": Sentences(b"\r", rb"#01(\d\d\.\d{3})", DCON),
    "icpdas-7024": Sentences(b"\r", rb"#010([+-]\d\d\.\d{3})", DCON),
    "adam-4024": Sentences(b"\r", rb"#01C0([+-]\d\d\.\d{3})", DCON),
    "alicat-pc": Sentences(b"\r", rb"as(\d+\.\d\d)", rb"a", 0.1),  # of 100 psi, at 10 V
    "mcu-line": Sentences(b"\n", rb"V1 (\d+\.\d{4})\*[0-9A-F]{2}", rb"(?:\?|W \d+|W\?|F\?|CLR|ID\?)\*[0-9A-F]{2}"),
}
RTU_OUTPUT = "waveshare-ao8b"
OUTPUTS = (*SENTENCES, RTU_OUTPUT)


def _crc_of(byte: int) -> int:
    for _ in range(8):
        byte = (byte >> 1) ^ (0xA001 if byte & 1 else 0)
    return byte


CRC_OF = tuple(map(_crc_of, range(256)))


@lru_cache(1024)
def crc16(data: bytes) -> int:
    """Of Modbus RTU."""
    crc = 0xFFFF
    for byte in data:
        crc = (crc >> 8) ^ CRC_OF[(crc ^ byte) & 0xFF]
    return crc


@dataclass
class LineObserver(Observer):
    """An observer of a device that is told lines of text."""

    sentences: Sentences = field(default_factory=lambda: SENTENCES["icpdas-702x"])

    def hear(self, chunk: bytes, now_s: float) -> None:
        *lines, self._line = (self._line + chunk).split(self.sentences.end)
        for heard in lines:
            line = self._without_dropped(heard)
            before = rb".*?" if self._is_cut else rb""
            if found := re.fullmatch(before + self.sentences.setting, line, re.DOTALL):
                if line == heard:
                    self._note_setting(float(found[1]) * self.sentences.volt, now_s)
            elif (
                not re.fullmatch(before + rb"(?:" + self.sentences.others + rb")", line, re.DOTALL) and not self._is_cut
            ):
                self.complain("I7", f"{heard!r} is no sentence", now_s)
            self._is_cut = False


@dataclass
class RtuObserver(Observer):
    """An observer of a Modbus RTU device whose register 0 is its voltage in mV: FC06 sets it, FC03 asks for it."""

    def hear(self, chunk: bytes, now_s: float) -> None:
        self._line += chunk
        while len(self._line) >= 8 + len(self._dropped):
            self._line = self._without_dropped(self._line)  # behind which the device finds the next one by its CRC
            frame = self._line[:8]
            if crc16(frame[:6]) != int.from_bytes(frame[6:], "little") or frame[0] != 1 or frame[1] not in (3, 6):
                if not self._is_cut:
                    self.complain("I7", f"{self._line.hex()} is no request", now_s)
                self._line, self._is_cut = self._line[1:], True
                continue
            self._line, self._is_cut = self._line[8:], False
            if frame[1] == 6:
                self._note_setting(unpack_from(">H", frame, 4)[0] * 1e-3, now_s)
