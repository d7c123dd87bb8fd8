"""Which writes are of consequence, and what is kept of them.

Kept are:
- every edge of the control word: enable, disable, reset_fault, tare, take_ownership, start_calibration and the others;
- every change of owner, and of a value of the command block;
- commit and slot_select of an upload;
- every refused write;
- what the control socket is asked to change: calibration, plant, runs, recording;
- what of all that came to nothing afterwards;
- each start, with the calibration and plant in use.

Not kept is what nothing follows from: reads, heartbeat and command_sequence, values written again as they are, the words of a
staged set before its commit, byte_order_echo.

What comes in streams is told in summaries (gateway.audit.write_series): of a value the first change at once, of an edge the
first 20 in 10 s, of a refusal the first 5 of its reason and peer. An edge is preceded by the summaries of its peer, so that the
order of the lines is the order of events. Peers are told apart by address or certificate, not by port.
"""

import json
from collections.abc import Callable, Mapping
from math import isfinite
from typing import Any, Final, NamedTuple

from gateway.audit.write_series import WriteSeries
from gateway.codes.refusals import RefusalReason
from gateway.modbus import Peer
from gateway.registers.refusal import Refusal
from gateway.registers.words import ControlBit
from gateway.registers.writes.admission import EDGE_BITS
from gateway.registers.writes.admitted_write import AdmittedWrite
from gateway.registers.writes.command_block import CONTROL_WORD, HEARTBEAT, NAMES, SEQUENCE, Values

MOST_SERIES: Final = 1000
_LONGEST_REQUEST: Final = 400
_VALUES: Final = tuple(k for k in range(len(NAMES)) if k not in (CONTROL_WORD, HEARTBEAT, SEQUENCE))
_UNITS: Final = {
    "force_setpoint": "N", "force_ramp": "N/s", "voltage_setpoint": "mV", "tilt_angle": "deg", "precontact_force": "N",
    "contact_ramp": "ms", "payload": "g", "in_band_tolerance": "N", "in_band_time": "ms",
}  # fmt: skip
_NO_VALUES: Final = (RefusalReason.QUANTITY, RefusalReason.UNIT)  # theirs is a count, or an id
_AT_ONCE_VALUE, _AT_ONCE_EDGE, _AT_ONCE_REFUSAL = 1, 20, 5
_BITS: Final = tuple((int(bit), str(bit.name).lower()) for bit in ControlBit)
_FALLS: Final = {"enable": "disable", "start_calibration": "stop_calibration"}


Owners = tuple[str | None, str | None]


class _States(NamedTuple):
    """What a write has found: control word and owner; and the owner after it."""

    word: int
    owner: str | None
    owner_after: str | None


class WriteAudit:
    """Told by the bank of each accepted command and each refused write, puts into the audit what is of consequence."""

    def __init__(self, put: Callable[[Mapping[str, Any]], None], clock: Callable[[], float]) -> None:
        self._put, self._clock = put, clock
        self._series: dict[tuple[str, str], WriteSeries] = {}
        self._look_s = 0.0

    def note_command(self, peer: Peer, before: Values, admitted: AdmittedWrite, owners: Owners) -> None:
        """Keep what an accepted write of the command block has changed. owners: before and after."""
        after, word = admitted.values, int(before[CONTROL_WORD])
        edges = int(admitted.command.control_word) & EDGE_BITS
        if edges or admitted.kept != word or owners[0] != owners[1] or admitted.is_stop:
            self._note_edges(peer, edges, admitted, _States(word, *owners))
        for k in _VALUES:
            if after[k] != before[k] and (told := self._count(peer, NAMES[k], _AT_ONCE_VALUE, (before[k], after[k]))):
                self._put(told)

    def note_act(self, name: str, text: str, peer: Peer) -> None:
        """Keep a commit or the choice of a slot."""
        self._put({**_who(peer), "what": name, "result": "accepted", "text": text})

    def note_refusal(self, refusal: Refusal, peer: Peer) -> None:
        """Keep a refused write: where, what, and the sentence that its master was given."""
        key = peer.identity, refusal.reason.name
        series = self._series.get(key)
        is_value = isfinite(refusal.value) and refusal.reason not in _NO_VALUES
        value = refusal.value if is_value else None
        fields = {
            **_who(peer), "what": "write", "address": refusal.address, "new": value,
            "result": refusal.reason.code, "text": refusal.sentence,
        }  # fmt: skip
        if series is None:
            series = self._begin(key, WriteSeries(_AT_ONCE_REFUSAL))
        series.fields = {name: fields[name] for name in fields if name != "new"}
        if series.take(None, value):
            self._put(fields)

    def note_local(self, verb: str, request: Mapping[str, Any], result: str) -> None:
        """Keep what the control socket was asked to change, and what came of it."""
        asked = json.dumps({key: value for key, value in request.items() if key != "do"})
        asked = asked if len(asked) <= _LONGEST_REQUEST else f"{asked[:_LONGEST_REQUEST]} ..."
        self._put({"peer": "control socket", "role": "admin", "what": verb, "new": asked, "result": result})

    def note_gateway(self, what: str, **fields: Any) -> None:
        """Keep what the gateway itself has done: a start, another calibration in use."""
        self._put({"peer": "gateway", "what": what, "result": "accepted", **fields})

    def flush(self) -> None:
        """End the windows that are over; called at each tick, looks at most once a second."""
        now_s = self._clock()
        if now_s < self._look_s:
            return
        self._look_s = now_s + 1.0
        for key in [key for key, series in self._series.items() if series.is_over(now_s)]:
            self._tell(key, now_s)

    def close(self) -> None:
        """Tell all that was only counted."""
        for key in tuple(self._series):
            self._tell(key, self._clock())

    def _note_edges(self, peer: Peer, edges: int, admitted: AdmittedWrite, states: _States) -> None:
        rises, falls = (admitted.kept & ~states.word) | edges, states.word & ~admitted.kept
        told = []
        for bit, name in _BITS:
            if rises & bit:
                told.append(self._count(peer, name, _AT_ONCE_EDGE, (0.0, 1.0)))
            elif falls & bit:
                told.append(self._count(peer, _FALLS.get(name, name), _AT_ONCE_EDGE, (1.0, 0.0)))
        if admitted.is_stop and not falls:
            told.append(self._count(peer, "stop", _AT_ONCE_EDGE, (0.0, 0.0)))
        if states.owner != states.owner_after:
            told.append(self._count(peer, "owner", _AT_ONCE_EDGE, (states.owner, states.owner_after)))
        if any(told):
            for key in [key for key in self._series if key[0] == peer.identity and key[1] in NAMES]:
                self._tell(key, self._clock())
        for fields in filter(None, told):
            self._put(fields)

    def _count(self, peer: Peer, name: str, at_once: int, change: tuple[Any, Any]) -> dict[str, Any] | None:
        """Count a write in its series; return the record of it where it is told by itself."""
        key = peer.identity, name
        series = self._series.get(key)
        if series is None:
            fields = {**_who(peer), "what": name, "result": "accepted"}
            if name in _UNITS:
                fields["unit"] = _UNITS[name]
            series = self._begin(key, WriteSeries(at_once, fields))
        old, new = change
        is_told = series.take(old, new) if name in NAMES else series.take(None, None)
        return {**series.fields, **_who(peer), "old": old, "new": new} if is_told else None

    def _begin(self, key: tuple[str, str], series: WriteSeries) -> WriteSeries:
        if len(self._series) >= MOST_SERIES:
            self.close()
        series.began_s = self._clock()
        self._series[key] = series
        return series

    def _tell(self, key: tuple[str, str], now_s: float) -> None:
        summary = self._series[key].summarize(now_s)
        if summary is None:
            del self._series[key]
        else:
            self._put(summary)


def _who(peer: Peer) -> dict[str, Any]:
    return {"peer": str(peer), "role": peer.role.name.lower()}
