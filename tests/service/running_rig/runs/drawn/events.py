"""What befalls lines, devices, machine and tool: drawn, for some time, and healed behind it or at the scene's end."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from gateway.bsfm.model import Response
from gateway.control import CalibrationInUse
from gateway.control.compensation.compensation import NO_COMPENSATION, Compensation, TimingCompensation
from tests.control.bench import bsfm
from tests.service.running_rig.runs.drawn import acts
from tests.service.running_rig.simulated_rig import TICK_S

if TYPE_CHECKING:
    from tests.service.running_rig.runs.drawn.scene import Scene

STALL_S: Final = 0.1
SHORT_S: Final = 0.02, 0.04, 0.08, 0.15, 0.4, 1.2, 4.0


def for_a_while(scene: "Scene", begin: Callable[[], object], end: Callable[[], object]) -> None:
    """As told last."""
    scene.judge.note_event(scene.told[-1].partition(" ")[2], lasts=True)
    begin()
    scene.rig.run(scene.draw.choice(SHORT_S))
    scene.judge.disturb()
    if scene.draw.random() < 0.8:
        end()


def cell(scene: "Scene") -> None:
    rig, draw = scene.rig, scene.draw
    how = draw.choice(("silent", "frozen", "garbled", "late", "noisy", "false", "away"))
    scene.note(f"cell {how}")
    if how == "late":
        for_a_while(scene, lambda: setattr(rig, "cell_late", draw.randint(1, 10)), lambda: setattr(rig, "cell_late", 0))
    elif how == "noisy":
        noise_n = draw.choice((0.3, 1.0, 3.0))
        for_a_while(
            scene, lambda: setattr(rig.plant, "noise_n", noise_n), lambda: setattr(rig.plant, "noise_n", rig.noise_n)
        )
    elif how == "false":
        for_a_while(scene, lambda: setattr(rig, "false_n", draw.choice((-60.0, -9.0, 9.0, 60.0, 200.0))), lambda: None)
    elif how == "away":
        for_a_while(scene, lambda: _unplug_cell(scene), lambda: _heal_cell(scene))
    else:
        for_a_while(scene, lambda: setattr(rig, "cell", how), lambda: _heal_cell(scene))


def _unplug_cell(scene: "Scene") -> None:
    scene.rig.cell = "silent"
    scene.rig.loop.cell_lost = True


def _heal_cell(scene: "Scene") -> None:
    rig = scene.rig
    rig.cell, rig.cell_late, rig.loop.cell_lost, rig.plant.noise_n = "well", 0, False, rig.noise_n
    scene.judge.note_end("cell")


def output(scene: "Scene") -> None:
    rig = scene.rig
    how = scene.draw.choice(("unanswered", "deaf", "refuses", "tripped", "away"))
    scene.note(f"output {how}")

    def begin() -> None:
        if rig.wire.how == "away":  # is plugged in again, and ill otherwise
            rig.loop.on_output_opened()
        rig.wire.how = how
        rig.loop.on_output_closed() if how == "away" else rig.wire.tick(rig.now())
        scene.judge.look()

    for_a_while(scene, begin, lambda: _heal_output(scene))


def _heal_output(scene: "Scene") -> None:
    rig, how = scene.rig, scene.rig.wire.how
    if how == "tripped":
        return  # until somebody resets
    rig.wire.how = "well"
    scene.judge.note_end("output")
    if how == "away":
        rig.loop.on_output_opened()


def note_reset(scene: "Scene") -> None:
    """A watchdog that had tripped watches again."""
    if scene.rig.wire.how == "well":
        scene.judge.note_end("output")


def valve(scene: "Scene") -> None:
    relay, draw, rig = scene.rig.relay, scene.draw, scene.rig
    if relay is None:
        return
    how = draw.choice(("stuck", "silent", "away"))
    scene.note(f"valve {how}")

    def begin() -> None:
        relay.is_stuck = how == "stuck"
        relay.silent_s = rig.now() if how == "silent" else None
        relay.lost = how == "away"

    for_a_while(scene, begin, lambda: _heal_valve(scene))


def _heal_valve(scene: "Scene") -> None:
    if relay := scene.rig.relay:
        relay.is_stuck, relay.silent_s, relay.lost = False, None, False
        scene.judge.note_end("valve")


def tool(scene: "Scene") -> None:
    """Contact, air, a push from outside, a machine that is stronger than it was."""
    plant, draw, rig = scene.rig.plant, scene.draw, scene.rig
    how = draw.choice(("contact", "air", "push", "sign", "unit"))
    scene.note(f"tool {how}")
    if how == "contact":
        for_a_while(scene, lambda: setattr(plant, "contact", not plant.contact), lambda: None)
    elif how == "air":
        for_a_while(scene, lambda: setattr(plant, "air", False), lambda: setattr(plant, "air", True))
    elif how == "push":
        push_n = draw.choice((-12.0, 3.0, 10.0, 45.0, 80.0))
        for_a_while(scene, lambda: setattr(rig, "outside_n", push_n), lambda: setattr(rig, "outside_n", 0.0))
    elif how == "unit":
        for_a_while(scene, lambda: setattr(plant, "unit", 0.102), lambda: setattr(plant, "unit", 1.0))
    elif rig.relay is None:
        for_a_while(scene, lambda: setattr(plant, "sign", -1.0), lambda: setattr(plant, "sign", 1.0))


def machine(scene: "Scene") -> None:
    """It stands still, or sleeps."""
    seconds, is_suspended = scene.draw.choice((0.05, 0.09, 0.13, 0.5, 3.0)), scene.draw.random() < 0.4
    scene.note(f"{'sleeps' if is_suspended else 'stands still'} for {seconds} s")
    scene.judge.note_event("machine", lasts=True)
    scene.rig.stand_still(seconds, is_suspended=is_suspended)
    scene.judge.note_end("machine")
    if scene.rig.relay is None and scene.draw.random() < 0.5:
        running = scene.laws.run
        acts.begin(scene)
        if scene.laws.run not in (None, running) and seconds > STALL_S:  # None: the standstill has ended it
            scene.judge.complain("a run has begun by what has waited")
    scene.rig.run(TICK_S)


def restart(scene: "Scene") -> None:
    """The process is killed; the guardian writes the safe voltage, and a new one is there some time later."""
    rig = scene.rig
    scene.note("killed")
    scene.judge.note_event("killed")
    rig.wire.set_voltage(rig.settings.limits.safe_voltage_v, rig.now())
    for _ in range(scene.draw.choice((2, 20))):
        rig.pass_by()
    scene.renew(is_restarted=True)


def commit(scene: "Scene") -> None:
    """Another calibration is in use from now on, as behind an upload."""
    draw, rig = scene.draw, scene.rig
    scene.scale, number = draw.choice((0.85, 1.0, 1.0, 1.15)), scene.calibration + 1
    response = draw.choice((None, Response(dead_time_s=0.03, lag_s=0.08)))
    scene.calibration = number
    scene.note(f"calibration {number}, {scene.scale}, {response}")
    rig.controller.use(CalibrationInUse(bsfm(scene.scale), number, response, draw.choice((0.0, 0.05))))
    rig.loop.refresh()


def heal(scene: "Scene") -> None:
    """All is as it was made."""
    rig = scene.rig
    scene.note("healed")
    scene.judge.note_event("healed")
    plant = rig.plant
    plant.contact = plant.air = True
    plant.unit, rig.outside_n = 1.0, 0.0
    plant.sign = -1.0 if rig.relay and rig.relay.stands.name == "PULL" else 1.0
    _heal_cell(scene)
    _heal_output(scene)
    _heal_valve(scene)


def plant(scene: "Scene") -> None:
    """Another plant is in use, which the rig is not: its timing is another one."""
    rig = scene.rig
    timing = TimingCompensation(delay_s=0.03, lags_s=0.1, more_s=0.02)
    compensation = scene.draw.choice((NO_COMPENSATION, Compensation(timing=timing)))
    if rig.controller.can_compensate_anew:
        scene.note("another plant is in use")
        rig.controller.compensate(rig.settings, compensation, CalibrationInUse(bsfm(scene.scale), scene.calibration))
        rig.loop.refresh()


EVENTS: Final = plant, cell, cell, output, output, valve, tool, tool, machine, restart, commit, commit


def befall(scene: "Scene") -> None:
    """One of them."""
    scene.draw.choice(EVENTS)(scene)
