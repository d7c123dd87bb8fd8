"""The rig of a seed: most often the demo rig on a slow loop, for the sake of time; now and then a fast loop, a load cell of
another rate, a directional valve, or other devices on the wires.
"""

from dataclasses import dataclass, replace
from functools import cache
from math import inf
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any

from gateway.calibrations.store import CalibrationStore
from gateway.control import LeadSettings, LeaseAction
from gateway.control.settings import ResponseSource, SafeDirection
from gateway.plants.store import NumberedPlant, PlantStore, Provenance
from gateway.profiles import Rig, load_device, load_plant, load_rig
from gateway.profiles.kinds.plant_writer import with_origins
from gateway.profiles.recordings_section import Retention
from gateway.profiles.rigs.assembly import check_report
from gateway.profiles.rigs.compensated_effects import compensation_of, in_simulation, without_compensable
from gateway.profiles.rigs.faces import RtuFace
from gateway.profiles.rigs.rig import ValveLine
from gateway.twin.plant import with_value
from tests.service.rigs import demo, with_supervision
from tests.simulation.draws.quiet_events import EVERY, QUIET
from tests.simulation.draws.sequences import has_recipes
from tests.simulation.judges.heard import OUTPUTS, RTU_OUTPUT, SENTENCES, LineObserver, RtuObserver
from tests.simulation.judges.observer import DOWN_S, Bounds, Observer
from tests.simulation.kernel.fits import marked

LEASE_S, STALL_S = 0.2, 0.1
POLL_S = 0.1
"""Until an output device is asked something where nothing changes."""
LEASES = ((LEASE_S, LeaseAction.FAULT),) * 20 + (
    (LEASE_S, LeaseAction.RAMP),
    (LEASE_S, LeaseAction.RAMP),
    (LEASE_S, LeaseAction.HOLD),
    (None, LeaseAction.FAULT),
)
"""How long a command lasts without a heartbeat, and what becomes of the force then."""
RATES_HZ = (20,) * 16 + (25,) * 3 + (50,)
"""Of loop and load cell, drawn for each seed: at 20 Hz a schedule takes half of the time, and its laws are the same."""
LEAST_HZ = 50
"""The least that a rig file may ask for. Slower loops are here for the sake of time and have no lead: a push that stands for
longer than the lags that it inverts goes beyond them, and such a loop swings."""
SLOW_HZ = 25
"""The most for rigs that have something else of their own, for the sake of time."""
OTHER_RATES_HZ = (50, 100, 250)
CELL_SHARES = (0.5, 1.0 / 3.0, 2.0)
"""Of a load cell's rate in the loop's, where they differ."""
DEMO_OUTPUT, DEMO_CELL = "smc-itv-rc", "stream-st-gs"
CELLS = ("hbm-aed", "hbm-aed-binary", "laumas-tlb", "mantracourt-dsc", "hx711-line", "adam-4016")
COUNTS_N = {"adam-4016": 10.0}
UNITS = {"mantracourt-dsc": ", unit: N", "laumas-tlb": ""}
VALVES = (
    ("waveshare-relay", SafeDirection.PUSH),
    ("waveshare-relay", SafeDirection.PUSH),
    ("mcu-valve", SafeDirection.PUSH),
    ("waveshare-relay", SafeDirection.PULL),
    ("mcu-valve", SafeDirection.KEEP),
)
"""What switches it, and where it goes while the output is off."""
KINDS = ("plain",) * 28 + ("rate",) + ("cell",) * 4 + ("valve",) * 3 + ("devices",) * 4 + ("bus",) * 3
TLS_SHARE = 0.08
ADAPTER_SHARE, ADAPTERS_S = 0.1, (0.001, 0.004, 0.016)
REST_SHARE, VARIED_SHARE = 0.05, 0.06
RESTS_V = (0.3, 0.0), (0.55, 0.55), (1.0, 0.0), (1.0, 1.0)
"""Safe voltages that press, where a tool would drop at 0 V, and the least that may be out."""
OWN_SHARE = 0.5
"""Of schedules with few events (quiet_events.py): those that have a rig which no other has."""
OWN_KINDS = ("valve",) * 4 + ("buses",) * 3 + ("devices",) * 2 + ("plain",) * 4
OWN_LEASES_S = 0.2, 0.2, 0.4, 1.0
OWN_BOUNDS: tuple[dict[str, Any], ...] = (
    {},
    {},
    {"idle_s": 2.0},
    {"requests_per_s": 25.0},
    {"connections": 9, "per_address": 1},
)
"""Of the network: an idle connection is closed soon, or whoever asks more waits, or there are places for the masters only."""
ROOMS = None, 60_000
"""Bytes of all recordings; a second of one takes ten thousand."""
BUS_TOO_SHARE = 0.2
"""Of rigs that have something else of their own."""
BOW = 0.005
OWN_EFFECTS = (
    ("cell", "quadratic_per_n", 0.002),
    ("cell", "cubic_per_n2", 5.0e-5),
    ("cell", "crosstalk_n_per_v", 0.4),
    ("cell", "zero_n_per_k", 0.15),
    ("regulator", "command_bow", 0.06),
    ("regulator", "command_s", 0.05),
    ("regulator", "delay_s", 0.05),
    ("regulator", "second_lag_s", 0.1),
)
"""What the plant of a rig of its own has more of than its calibration was made with, at most: control takes it back."""
LONGER = "delay_s", "second_lag_s"
"""Of these, what is never less."""
RIG = """name: pair
plant: paper-slide
calibration: demo
output: {{device: {output}, port: /dev/serial/by-id/output}}
load_cell: {{device: {cell}, port: /dev/serial/by-id/cell, range_n: 98.07{more}}}
limits: {{force_max_n: 60, over_force_n: 75, voltage_max_v: 8.5, safe_voltage_v: 0}}
defaults: {{force_ramp_n_per_s: 200, precontact_force_n: 3}}
trim: {{gain_v_per_n_s: 0.3, limit_v: 0.5}}
lead: {{lag_s: 0.072, second_lag_s: 0.072}}
supervision: {{sample_timeout_s: 0.25, output_timeout_s: 0.3, saturation_n: 96}}
self_test: {{force_n: 15}}
network: {{allow_plain_upload: true}}
accept_no_device_watchdog: {unwatched}
"""
PLANTS_EVERY = 8
"""Of so many rigs one has numbered plants stored."""
RECIPES = -1500, -4000
"""Marks of calibrations that expect less force of a voltage than the one in use, as of another pad."""
WATCHED = frozenset(("icpdas-702x", "icpdas-7024", "adam-4024", "mcu-line"))


@dataclass(frozen=True)
class Drawn:
    """rig: as the gateway has it; cell_s: between two readings of a load cell that talks by itself, None for one that is asked;
    output: the device on that wire."""

    rig: Rig
    cell_s: float | None
    output: str = DEMO_OUTPUT

    def observer(self) -> Observer:
        """Who hears what this output is told."""
        bounds = bounds_of(self.rig)
        if self.output == RTU_OUTPUT:
            return RtuObserver(bounds)
        return LineObserver(bounds, sentences=SENTENCES[self.output]) if self.output in SENTENCES else Observer(bounds)


def bounds_of(rig: Rig) -> Bounds:
    """What the rig's file says."""
    supervision, limits = rig.control.supervision, rig.control.limits
    return Bounds(
        limits.voltage_max_v,
        limits.voltage_slew_v_per_s,
        supervision.sample_timeout_s,
        supervision.stall_s,
        supervision.lease_s or inf if supervision.lease_action is not LeaseAction.HOLD else inf,
        1.0 / rig.loop_hz,
        DOWN_S if supervision.lease_action is LeaseAction.RAMP else 0.0,
        supervision.output_timeout_s + rig.output.device.reply_timeout_s + POLL_S,
        rig.output.device.reply_timeout_s,
        limits.over_force_n,
        limits.safe_voltage_v,
        limits.voltage_min_v,
    )


def draw_rig(seed: int) -> Drawn:
    """The rig of this seed, with strict bounds: a cell that is late by two samples and a half is lost."""
    loop_hz, chance = Random(f"rate {seed}").choice(RATES_HZ), Random(f"rig 2 {seed}")
    kind, output, share = chance.choice(KINDS), DEMO_OUTPUT, 1.0
    own = _draw_own(seed)
    kind = own.choice(OWN_KINDS) if own else kind
    if kind != "plain":
        loop_hz = min(loop_hz, SLOW_HZ)
    if kind == "rate":
        loop_hz = chance.choice(OTHER_RATES_HZ)
    elif kind == "cell":
        share = chance.choice(CELL_SHARES)
    elif kind == "devices":
        output = chance.choice(OUTPUTS)
    rig = demo() if kind != "valve" else with_valve(*Random(f"valve {seed}").choice(VALVES))
    if kind == "devices":
        rig = with_devices(output, chance.choice(CELLS))
    if kind == "bus" or (kind != "plain" and Random(f"bus beside {seed}").random() < BUS_TOO_SHARE):
        rig = replace(rig, fieldbus=(RtuFace(type="rtu", port="bus"),))
    if own:
        rig = _with_own(rig, kind, own)
    if own and kind == "plain":
        rig = _with_effects(rig, own)
        loop_hz = own.choice((loop_hz, LEAST_HZ))
    cell_hz = share * loop_hz
    rig = _varied(_resting(rig, Random(f"safe {seed}")), Random(f"varied 2 {seed}"))
    device = rig.load_cell.device
    if reading := device.read_force:
        cell_hz = min(cell_hz, reading.rate_hz or cell_hz)
        asked = replace(device, read_force=replace(reading, rate_hz=2.0 * cell_hz))  # so that each tick finds it due
        rig = replace(rig, load_cell=replace(rig.load_cell, device=asked))
    return Drawn(_strict(rig, seed, loop_hz, cell_hz), 1.0 / cell_hz if device.stream else None, output)


def _draw_own(seed: int) -> Random | None:
    """Return what a rig of its own is drawn from; None for most."""
    chance = Random(f"own rig 64 {seed}")
    return chance if seed % EVERY == QUIET and chance.random() < OWN_SHARE else None


def _with_own(rig: Rig, kind: str, chance: Random) -> Rig:
    """In these, there may be two serial faces, other bounds of the network, little room for recordings; and a lease of another
    length."""
    buses = ("bus", "second bus") if kind == "buses" else ("bus",) if chance.random() < BUS_TOO_SHARE else ()
    network = replace(rig.network, **chance.choice(OWN_BOUNDS))
    faces = tuple(RtuFace(type="rtu", port=bus) for bus in buses)
    return replace(rig, network=network, fieldbus=faces, retention=Retention(bytes=chance.choice(ROOMS)))


def _with_effects(rig: Rig, chance: Random) -> Rig:
    """In these, the plant has one to three effects of which control knows, and the lags are those of the rig's file."""
    assert rig.plant_profile
    base = plant = rig.plant_profile.plant
    for section, name, most in chance.sample(OWN_EFFECTS, chance.choice((1, 1, 2, 3))):
        more = most * chance.uniform(0.2, 1.0) * (1 if name in LONGER else chance.choice((1, -1)))
        plant = with_value(plant, section, name, getattr(getattr(plant, section), name) + more)
    compensation = in_simulation(compensation_of(without_compensable(base), plant))
    control = replace(rig.control, response=ResponseSource.RIG)
    profile = replace(rig.plant_profile, plant=plant)
    return replace(rig, plant_profile=profile, compensation=compensation, control=control)


def _resting(rig: Rig, chance: Random) -> Rig:
    """In few rigs the safe voltage is not 0 V; with a valve it must be."""
    if chance.random() > REST_SHARE or rig.valve:
        return rig
    safe_v, least_v = chance.choice(RESTS_V)
    limits = replace(rig.control.limits, safe_voltage_v=safe_v, voltage_min_v=least_v)
    return replace(rig, control=replace(rig.control, limits=limits))


def _varied(rig: Rig, chance: Random) -> Rig:
    """In few rigs a push reads negative, small forces are given none, and the force rises slowly behind the touch."""
    if chance.random() > VARIED_SHARE:
        return rig
    limits = replace(rig.control.limits, smallest_force_n=chance.choice((0.0, 2.0, 5.0)))
    defaults = replace(rig.control.defaults, contact_ramp_s=chance.choice((0.0, 0.2, 1.0)))
    cell = replace(rig.load_cell, sign=chance.choice((1, -1, -1)))
    return replace(rig, load_cell=cell, control=replace(rig.control, limits=limits, defaults=defaults))


def draw_badges(seed: int) -> dict[str, tuple[str, str]]:
    """Name and role of everybody's certificate, for the few whose masters come by TLS."""
    chance = Random(f"certificates {seed}")
    if chance.random() > TLS_SHARE:
        return {}
    roles = {
        "worker": "setpoint",
        "rival": chance.choice(("monitor", "setpoint")),
        "fool": chance.choice(("monitor", "setpoint", "calibration")),
        "villain": "monitor",
        "healer": chance.choice(("setpoint", "admin")),
        "reader": "monitor",
        "integrator": chance.choice(("setpoint", "calibration", "admin")),
        "designer": "calibration",
    }
    return {name: (f"the {name}", role) for name, role in roles.items()}


def draw_adapter_s(seed: int) -> float:
    """How often this machine's serial adapters hand over what has come, s; in most of them each message comes whole."""
    chance = Random(f"adapter 9 {seed}")
    return chance.choice(ADAPTERS_S) if chance.random() < ADAPTER_SHARE else 0.0


def _strict(rig: Rig, seed: int, loop_hz: float, cell_hz: float) -> Rig:
    if rig.load_cell.device.read_force:  # it is asked at a tick
        cell_hz = 1.0 / (1.0 / cell_hz + 1.0 / loop_hz)
    is_fed = getattr(rig.output.device.watchdog, "feed", None) is not None
    ticks = 4.0 if is_fed else 3.0  # a watchdog is fed at a tick of its own
    bounds = {
        "sample_timeout_s": max(0.05, 2.5 / min(loop_hz, cell_hz)),
        "output_timeout_s": max(0.1, ticks / loop_hz, 1.7 * rig.output.device.reply_timeout_s),
    }
    lease_s, action = Random(f"lease {seed}").choice(LEASES)
    lease_s = OWN_LEASES_S[seed // EVERY % len(OWN_LEASES_S)] if lease_s and _draw_own(seed) else lease_s
    if loop_hz < LEAST_HZ:
        rig = replace(rig, control=replace(rig.control, response=ResponseSource.RIG, lead=LeadSettings()))
    rig = with_supervision(rig, lease_s=lease_s, lease_action=action, stall_s=STALL_S, **bounds)
    lines = {"output": replace(rig.output, port="output"), "load_cell": replace(rig.load_cell, port="load_cell")}
    if rig.valve:
        lines["valve"] = replace(rig.valve, port="valve")
    assert rig.plant_profile
    plant = rig.plant_profile.plant  # without inertia its steps may be of any length; it lies, so that it has no weight
    still = replace(plant.contact, mass_kg=0.0, pad_damping_n_s_per_m=0.0)
    profile = replace(rig.plant_profile, plant=replace(plant, contact=still))
    return replace(rig, seed=seed, loop_hz=loop_hz, plant_profile=profile, **lines)


@cache
def with_valve(device: str, safe: SafeDirection) -> Rig:
    """The paper's rig that pulls, with this device at its valve."""
    rig = load_rig("paper-pull")
    assert rig.control.valve
    control = replace(rig.control, valve=replace(rig.control.valve, safe=safe))
    return replace(rig, valve=ValveLine.of(load_device(device), None, None), control=control)


@cache
def with_devices(output: str, cell: str) -> Rig:
    """The demo rig with other devices on its wires."""
    more = UNITS.get(cell, f", newton_per_count: {COUNTS_N.get(cell, 0.01)}")
    unwatched = "false" if output in WATCHED else "true"
    with TemporaryDirectory() as folder:
        file = Path(folder) / "pair.yaml"
        file.write_text(RIG.format(output=output, cell=cell, more=more, unwatched=unwatched), encoding="utf-8")
        report = check_report(file, simulated=True)
    assert report.rig, report.faults
    return report.rig


def store_documents(seed: int, rig: Rig, state: Path) -> tuple[int, ...]:
    """Store what somebody may take into use, in few rigs; return the marks of the calibrations."""
    if seed % PLANTS_EVERY == 0:
        _store_plants(rig, state)
    if not has_recipes(seed):
        return ()
    for mark in RECIPES:
        CalibrationStore(state, rig.calibration).add(marked(rig.calibration, mark))
    return RECIPES


def _store_plants(rig: Rig, state: Path) -> None:
    """Two numbered plants: the shipped one, and one whose command is bent a little, for which control compensates."""
    plain = load_plant("paper-slide")
    told = Provenance(made_utc="2026-11-22T17:30:00Z", version="0.1.0", rig=rig.name, start=plain.name)
    plant = with_value(plain.plant, "regulator", "command_bow", BOW)
    bent = with_origins(replace(plain, name="bent"), plant, {"regulator.command_bow": "diagnosed"})
    for profile in (plain, bent):
        PlantStore(state).add(NumberedPlant(number=0, profile=profile, provenance=told))
