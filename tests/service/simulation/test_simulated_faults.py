"""Each fault that `sim set` knows, in virtual time through the whole control loop: which code, and the safe voltage."""

from dataclasses import replace

import pytest

from gateway.codes.faults import FaultCode
from gateway.devices import DeviceRole
from gateway.registers.words import State
from tests.profile_files import load_device
from tests.service.every_device.test_every_device_presses import PROFILES, rig_with
from tests.service.rigs import strict
from tests.service.wired import ENABLE, RESET, Wired

OUTPUTS = [profile for profile in PROFILES.values() if profile.role is DeviceRole.OUTPUT]


def simulate(wired: Wired, *, clear_all: bool = False, **values: object) -> None:
    named = {name.replace("__", "."): value for name, value in values.items()}
    wired.world.simulate({"do": "sim", "set": named, "clear_all": clear_all})


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("name", "value", "fault"),
    [
        ("cell.silent", True, FaultCode.SAMPLE_STALE),
        ("cell.frozen", True, FaultCode.SAMPLE_FROZEN),
        ("cell.inverted", True, FaultCode.SIGN_INVERTED),
        ("output.silent", True, FaultCode.OUTPUT_SILENT),
        ("output.refuse", True, FaultCode.OUTPUT_REFUSED),
        ("output.alter", 0.5, FaultCode.OUTPUT_ALTERED),
    ],
)
def test_a_fault_leads_to_its_code_and_the_safe_voltage_and_cleared_the_force_returns(name, value, fault) -> None:
    wired = Wired(strict()).pressing(20.0)
    simulate(wired, **{name: value})
    wired.write(0, ENABLE, 2600)
    wired.until(lambda: wired.state is State.FAULT, 6.0)
    assert wired.fault_code is fault, wired.log
    simulate(wired, clear_all=True)
    wired.run(0.5)
    assert wired.observer.settings[-1].voltage_v == 0.0
    wired.write(0, RESET, 0)
    wired.run(0.3)
    wired.write(0, ENABLE, 1500)
    wired.until(lambda: abs(wired.force_n - 15.0) <= 1.0, 3.0)
    wired.observer.check(wired.rig)


@pytest.mark.parametrize("key", ["stream", "read_force"])
@pytest.mark.parametrize("inverted", [False, True], ids=["over", "under"])
def test_a_cell_that_says_its_overload_without_a_number_trips_over_force(key, inverted) -> None:
    reading = replace(
        load_device("stream-st-gs").reading,
        blank_is_overload=False,
        overload=("S +",),
        underload=("S -",),
        rate_hz=50.0,
    )
    said = {"stream": None, "read_force": None, key: replace(reading, ask="SI" if key == "read_force" else "")}
    wired = Wired(rig_with(replace(load_device("stream-st-gs"), **said))).pressing(20.0)
    simulate(wired, cell__scale=8.0, cell__inverted=inverted)
    took_s = wired.until(lambda: wired.state is State.FAULT, 0.5)
    assert wired.fault_code is FaultCode.OVER_FORCE, wired.log
    assert took_s < 0.2, "long before the sample would be too old"
    assert "cell saturated" in wired.log[-1][1]
    assert wired.loop.cell_counts.garbled == 0


@pytest.mark.parametrize("output", OUTPUTS, ids=lambda output: output.name)
def test_every_output_refuses_in_a_way_that_is_understood(output) -> None:
    wired = Wired(rig_with(output)).pressing(12.0)
    simulate(wired, output__refuse=True)
    wired.write(0, ENABLE, 1500)
    wired.until(lambda: wired.state is State.FAULT, 2.0)
    assert wired.fault_code is FaultCode.OUTPUT_REFUSED
    assert wired.exchange.counts.garbled == 0


def test_without_air_the_force_is_gone_and_comes_back_with_it() -> None:
    wired = Wired(strict()).pressing(20.0)
    simulate(wired, air__off=True)
    wired.until(lambda: wired.twin.pressure_pa < 1e3, 2.0)
    simulate(wired, clear_all=True)
    wired.run(0.1)
    if wired.state is State.FAULT:
        wired.write(0, RESET, 0)
        wired.run(0.3)
    wired.write(0, ENABLE, 1500)
    wired.until(lambda: abs(wired.force_n - 15.0) <= 1.0, 3.0)
    assert wired.twin.pressure_pa > 1e5


def test_noise_on_the_wires_costs_sentences_and_not_the_force() -> None:
    wired = Wired().pressing(20.0)
    simulate(wired, wire__noise=0.002)
    wired.run(2.0)
    assert wired.loop.cell_counts.garbled > 0
    assert wired.state is State.HOLDING, wired.log
    assert wired.force_n == pytest.approx(20.0, abs=1.5)


def test_noise_of_the_cell_is_as_large_as_it_is_set() -> None:
    wired = Wired().pressing(20.0)
    simulate(wired, noise=0.6)
    found = [wired.force_n for _ in wired.samples(1.0)]
    mean_n = sum(found) / len(found)
    assert 0.4 < (sum((one - mean_n) ** 2 for one in found) / len(found)) ** 0.5 < 0.8


def test_an_effect_that_is_set_while_a_force_is_held_shows_in_the_force_without_a_jump() -> None:
    """Creep of half the force pushes with its own time constant; the trim follows it."""
    wired = Wired().pressing(20.0)
    wired.run(0.5)
    held_n = wired.twin.force_n
    simulate(wired, **{"creep.creep_share": 0.5, "creep.creep_s": 0.5})
    wired.run(0.005)
    assert wired.twin.force_n == pytest.approx(held_n, abs=0.3)
    wired.run(0.4)
    assert wired.twin.force_n > held_n + 2.0


def test_an_impossible_plant_changes_nothing() -> None:
    wired = Wired()
    simulate(wired, creep=0.1)
    twin, settings = wired.world.twin.plant, wired.world.settings
    with pytest.raises(ValueError, match="E133"):
        simulate(wired, creep=-1.0)
    assert (wired.world.twin.plant, wired.world.settings) == (twin, settings)


def test_a_valve_that_is_stuck_is_one_of_a_rig_with_a_valve() -> None:
    wired = Wired()
    with pytest.raises(ValueError, match="no valve"):
        simulate(wired, valve__stuck=True)
