"""All that a request could change, seen at one moment, and what differs between two."""

from struct import unpack
from typing import Any, NamedTuple


class Look(NamedTuple):
    """All that a request could change. words: the registers, but for those of the last refusal;
    told: of upload, recording and run."""

    words: bytes
    owner: str | None
    writers: dict[str, Any]
    asked_v: float
    told: str

    @property
    def command(self) -> list[float]:
        """The command block, in the registers' units."""
        return list(unpack(">16f", self.words[400:464]))

    def word(self, address: int) -> int:
        return int.from_bytes(self.words[2 * address : 2 * address + 2], "big")

    def number(self, address: int) -> float:
        return float(unpack(">f", self.words[2 * address : 2 * address + 4])[0])


def changed_words(before: Look, after: Look) -> list[int]:
    if before.words == after.words:
        return []
    return [k // 2 for k in range(0, len(before.words), 2) if before.words[k : k + 2] != after.words[k : k + 2]]


def differences(before: Look, after: Look) -> list[str]:
    facts = zip(Look._fields[1:], before[1:], after[1:], strict=True)
    told = [f"{name}: {was} -> {now}" for name, was, now in facts if was != now]
    return told + [f"register {k}: {before.word(k):x} -> {after.word(k):x}" for k in changed_words(before, after)]
