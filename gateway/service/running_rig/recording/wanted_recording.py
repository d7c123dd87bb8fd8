"""What a recording was asked for, as it goes on: in another file, behind a full disk, and in the next control process."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

from gateway.recording.label import NO_LABEL, RecordingLabel


@dataclass(frozen=True, slots=True)
class WantedRecording:
    """for_s: it ends by itself so long after its first tick, 0: it does not; ends_s: the monotonic time of that end, None
    before the tick; began_in: the path of its first file, empty before that is open."""

    label: RecordingLabel = NO_LABEL
    for_s: float = 0.0
    ends_s: float | None = None
    began_in: str = ""

    def with_end(self, now_s: float) -> "WantedRecording":
        """Return what it is from its first tick on."""
        return replace(self, ends_s=now_s + self.for_s) if self.for_s and self.ends_s is None else self

    def in_file(self, path: str) -> "WantedRecording":
        """Return what it is once a file of it is open."""
        return self if self.began_in else replace(self, began_in=path)

    def is_over(self, now_s: float) -> bool:
        """Decide whether its time is over."""
        return self.ends_s is not None and now_s >= self.ends_s

    def as_facts(self) -> dict[str, Any]:
        """Return it as JSON takes it."""
        return asdict(self)

    @classmethod
    def from_facts(cls, facts: Mapping[str, Any]) -> "WantedRecording":
        """Return what `as_facts` has told."""
        return cls(**{**facts, "label": RecordingLabel(**facts["label"])})
