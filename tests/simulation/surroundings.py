"""What is around the gateway: the simulated rig and its wires, what is done to them, and what the observer is told of it."""

import json
from collections.abc import Callable
from contextlib import suppress
from math import inf
from typing import Any

from gateway.devices import output_device
from gateway.devices.device_checks.watchdog import WatchdogState
from gateway.profiles import Rig
from gateway.service.simulation.world import SimulatedRig
from tests.simulation.draws.rigs import draw_adapter_s
from tests.simulation.judges.observer import Observer
from tests.simulation.judges.reason_judge import CELL, OUTPUT, ReasonJudge
from tests.simulation.kernel.cables import CABLES, lay_cables
from tests.simulation.kernel.virtual_time import VirtualLoop

LOOSE_S = 0.1
"""In which a valve that was stuck goes where its relay has it."""
UNWATCHED_S = 2.0
"""In which a device's watchdog that is not armed is looked at, and armed; a spoiled answer costs another look."""
NOTICED_S = 0.1
"""So long behind a loss of power it is still told: it may be shorter than from one look to the next."""
FIRST_SETTING_S = 0.3
"""On a line that is back: a watchdog is fed before the safe voltage goes out."""


class Surroundings:
    """cell_s: between two readings of a load cell that talks by itself; cell_pace: how many times longer it takes now;
    is_whole: whether every wire is, and each device at its own pace, as it was told last."""

    cell_pace = 1.0
    is_whole = True
    _dark_until_s = 0.0
    _freed_s = -LOOSE_S
    _spoiled_s = -inf  # when an answer of the output was lost last, but for those that its cable spoiled
    _is_stuck = False
    _back_s = 0.0  # when a line that was lost has brought its first byte
    _unwatched_s: float | None = None

    def __init__(self, rig: Rig, outside: VirtualLoop, observer: Observer, cell_s: float | None) -> None:
        self._rig, self._outside, self._observer, self.cell_s = rig, outside, observer, cell_s
        self._pulled = set[str]()  # since the last look, and perhaps pushed again
        self.world = SimulatedRig(
            rig,
            send_output=lambda data: CABLES["output"].send_to_host(data),
            send_cell=lambda data: CABLES["load_cell"].send_to_host(data),
            now_s=outside.clock.now_s,
        )
        self._move_valve, self.world.valve.move = self.world.valve.move, self._judge_valve  # type: ignore[method-assign]
        lay_cables(outside, rig, self._on_output, self.world.on_cell_bytes, self._on_valve)
        adapter_s = draw_adapter_s(rig.seed)
        for cable in CABLES.values():
            cable.adapter_s = adapter_s
        CABLES["load_cell"].on_host = observer.hear_cell
        CABLES["output"].on_unheard = observer.history.cuts.append
        CABLES["output"].on_dropped = observer.note_dropped
        if cell_s:
            outside.call_later(0.3 * cell_s, self._stream)

    # -- what is done to them

    def set_fault(self, name: str, *, on: bool) -> None:
        """By the verb `fault` of rig.sock."""
        self.world.fault({"do": "fault", "name": name, "on": on})
        self._judge()

    def simulate(self, request: dict[str, Any]) -> None:
        """By the verb `sim` of rig.sock; what no rig has is refused."""
        with suppress(ValueError):
            self.world.simulate(request)
        self._judge()

    def set_as_asked(self, line: bytes, ask: Callable[[bytes], None]) -> None:
        """As the tools do: control is asked first, then the simulated rig."""
        ask(line)
        self.simulate(json.loads(line))

    def lose_power(self, dark_s: float, power_on_v: float) -> None:
        """The output device alone goes dark, and comes back as one that has just been switched on."""
        now_s = self._outside.clock.now_s
        self.world.advance(now_s)
        self.world._output = output_device(self._rig.output.device)
        self._dark_until_s = now_s + dark_s
        self._stand_at(0.0)
        self._outside.call_later(dark_s, self._stand_at, power_on_v)

    def _stand_at(self, voltage_v: float) -> None:
        self.world._setting_v = voltage_v
        self.world.twin.command(voltage_v)
        self._judge()

    def pull(self, line: str) -> None:
        """Pull the plug of this line."""
        CABLES[line].pull()
        self._pulled.add(line)
        if line == "output":
            now_s = self._outside.clock.now_s
            self._observer.note_cut(now_s)
            self._observer.output_lost_s, self._back_s = now_s, 0.0
        self._judge()

    def deafen(self, *, on: bool) -> None:
        """Break the wire on which the output hears, or mend it: it stays where it is, and answers nothing."""
        cable, now_s = CABLES["output"], self._outside.clock.now_s
        if on and not cable.is_deaf:
            cable.cut()
            self._observer.note_cut(now_s)
            self._observer.output_lost_s, self._back_s = now_s, 0.0
        elif cable.is_deaf and not on:
            self._observer.note_mended()
        cable.is_deaf = on

    def push(self, line: str) -> None:
        """Put it back."""
        CABLES[line].push()
        self._judge()

    def pressing_n(self) -> float:
        """What the air presses with, in whichever chamber."""
        twin = self.world.twin
        return twin.plant.cylinder.area_m2 * twin.pressure_pa

    # -- what the observer is told

    def _judge(self) -> None:
        """Whether cell and output can be heard now, and since when they cannot."""
        now_s, observer, settings = self._outside.clock.now_s, self._observer, self.world.settings
        is_cell_lost = settings.is_on("cell.silent") or not CABLES["load_cell"].is_plugged
        observer.cell_lost_s = _since(observer.cell_lost_s, is_cell_lost, now_s)
        is_silent = settings.is_on("output.silent") or now_s < self._dark_until_s
        observer.answers_lost_s = _since(observer.answers_lost_s, is_silent, now_s)
        if self._is_stuck and not settings.is_on("valve.stuck"):
            self._freed_s = now_s
        self._is_stuck = settings.is_on("valve.stuck")

    def look(self) -> None:
        """A sentence that fits is a sample, or an answer, whoever says it: cell and output are lost from then on."""
        observer, output, cell = self._observer, CABLES["output"], CABLES["load_cell"]
        observer.cell_heard_s = observer.cell_said_s if observer.history.is_plain else cell.heard_s
        if self.world.settings.number("wire.noise") > 0.0 or observer.answers_lost_s is not None:
            self._spoiled_s = self._outside.clock.now_s  # who answers again has not heard what was asked before
        observer.answer_spoiled_s = max(self._spoiled_s, output.spoiled_s)
        if observer.cell_lost_s is not None:
            observer.cell_lost_s = max(observer.cell_lost_s, cell.strange_s)
        if observer.answers_lost_s is not None:
            observer.answers_lost_s = max(observer.answers_lost_s, output.strange_s)
        self._judge_watchdog()

    def _judge_watchdog(self) -> None:
        """While it presses, the device's own watchdog watches; one that has forgotten is armed anew."""
        watchdog = getattr(self.world._output, "watchdog", None)
        is_off = watchdog is not None and watchdog.state is WatchdogState.OFF
        if not is_off or self._observer.is_safe or self._observer.output_lost_s is not None:
            self._unwatched_s = None
            return
        now_s = self._outside.clock.now_s
        if self._unwatched_s is None:
            self._unwatched_s = now_s
        if now_s - self._unwatched_s > UNWATCHED_S:
            self._observer.complain("I6", "it presses, and the device's watchdog does not watch", now_s)
            self._unwatched_s = now_s

    def _judge_valve(self, now_s: float) -> bool:
        """The valve is moved without pressure, whatever its relay was told and when; but for one that comes loose, which its
        relay has been holding elsewhere and nobody could see."""
        is_loose = now_s - self._freed_s < LOOSE_S
        if (has_moved := self._move_valve(now_s)) and self._observer.voltage_v > 0.0 and not is_loose:
            self._observer.broken.append(f"valve at {now_s:.4f}: it moves under {self._observer.voltage_v:.3f} V")
        return has_moved

    def tell_reasons(self, reasons: ReasonJudge) -> None:
        """Say what is disturbed now."""
        now_s = self._outside.clock.now_s
        disturbed = [line for line, cable in CABLES.items() if cable.is_disturbed(now_s)]
        is_slow, is_dark = self.cell_pace != 1.0, now_s < self._dark_until_s + NOTICED_S
        port = CABLES["output"].port  # behind a plug that is back it opens a moment later
        self.is_whole = port is not None and port.is_open and not (disturbed or is_slow or is_dark)
        if disturbed or self._pulled:
            for line in (*disturbed, *sorted(self._pulled)):
                reasons.note(line, now_s)
            self._pulled.clear()
        if is_slow:
            reasons.note(CELL, now_s)
        if is_dark:
            reasons.note(OUTPUT, now_s)

    # -- their wires

    def _on_output(self, chunk: bytes, now_s: float) -> None:
        observer = self._observer
        settings = observer.settings
        observer.hear(chunk, now_s)
        if observer.output_lost_s is not None:
            self._back_s = self._back_s or now_s
            if observer.settings > settings or now_s - self._back_s > FIRST_SETTING_S:
                observer.output_lost_s, self._back_s = None, 0.0
        if now_s > self._dark_until_s:
            self.world.on_output_bytes(chunk, now_s)

    def _on_valve(self, chunk: bytes, now_s: float) -> None:
        CABLES["valve"].send_to_host(self.world.on_valve_bytes(chunk, now_s))

    def _stream(self) -> None:
        assert self.cell_s
        if CABLES["load_cell"].backlog_s < 0.01:
            self.world.stream(self._outside.clock.now_s)
        self._outside.call_later(self.cell_pace * self.cell_s, self._stream)


def _since(lost_s: float | None, is_lost: bool, now_s: float) -> float | None:
    return None if not is_lost else now_s if lost_s is None else lost_s
