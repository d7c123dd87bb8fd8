"""How many lines of the audit there must be: one for each accepted edge, change of owner and changed value, and for each
refused write, with the name of who asked; and none else. Streams are summed up: their counts count."""

import re
from collections import Counter
from typing import Any

from gateway.modbus import Peer

VALUES = {
    1: "force_setpoint", 2: "force_ramp", 3: "mode", 5: "voltage_setpoint", 6: "tilt_angle", 7: "precontact_force",
    8: "contact_ramp", 9: "payload", 11: "in_band_tolerance", 12: "in_band_time",
}  # fmt: skip
BITS = {1: "enable", 2: "reset_fault", 4: "tare", 8: "take_ownership", 16: "valve_pull", 32: "start_calibration",
        64: "start_self_test"}  # fmt: skip
FALLS, RUNS = {1: "disable"}, (32, 64)
MOMENTARY = 2 | 4 | 8
CHANGING = "record", "calibration", "plant", "calibrate", "sim"
NOT_COUNTED = "stop", "stop_calibration", "commit", "slot_select"
"""Ends of runs, which have more than one, and acts of an upload: others look at these."""


class AuditCount:
    def __init__(self) -> None:
        self.lines: list[dict[str, Any]] = []
        self._wanted: Counter[tuple[str, str]] = Counter()

    def note_local(self, request: dict[str, Any]) -> None:
        """What the control socket has been asked to change, and has taken."""
        if request["do"] in CHANGING and len(request) > 1 and not request.get("dry_run"):
            self._wanted["control socket", request["do"]] += 1

    def note_refused(self, peer: Peer) -> None:
        self._wanted[_name(str(peer)), "refused"] += 1

    def note_accepted(
        self, peer: Peer, values: tuple[list[float], list[float]], written: int | None, owners: Any
    ) -> None:
        """values: of the command block before and behind it."""
        before, after = values
        # a bit that is written as 1 and reads 0 has fallen by the end of a run; who clears enable clears all
        who, word, now = _name(str(peer)), int(before[0]), int(after[0])
        edges = [BITS[bit] for bit in BITS if (now & ~word | (written or 0) & MOMENTARY) & bit]
        fell = word & ~now & (word if written is not None and word & ~written & 1 else ~(written or 0))
        falls = [FALLS.get(bit, BITS[bit]) for bit in BITS if bit not in RUNS and fell & bit]
        changed = [name for k, name in VALUES.items() if before[k] != after[k]]
        self._wanted.update((who, what) for what in (*edges, *falls, *changed))
        is_ended = bool((written or 0) & ~now & 1)  # by control, which has found its lease over, say: not by who writes
        if owners[0] != owners[1] and not is_ended:
            self._wanted[who, "owner"] += 1

    def broken(self) -> list[str]:
        told: Counter[tuple[str, str]] = Counter()
        for line in self.lines:
            ends_run = line["what"] == "start_self_test" and line.get("old") == 1.0
            is_local = line["peer"] == "control socket"
            if ends_run or line["peer"] == "gateway" or line["what"] in NOT_COUNTED:
                continue
            if is_local and line["result"] != "accepted":
                continue
            what = line["what"] if line["result"] == "accepted" else "refused"
            told[_name(line["peer"]), what] += line.get("count", 1)
        different = told.keys() | self._wanted.keys()
        return [
            f"audit: {key} is told {told[key]} times, and was {self._wanted[key]} times"
            for key in sorted(different)
            if told[key] != self._wanted[key]
        ]


def _name(peer: str) -> str:
    return re.sub(r":\d+(\)?)$", r"\1", peer) if not peer.startswith("serial:") else peer
