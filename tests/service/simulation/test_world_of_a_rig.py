"""The simulated rig alone, at the far end of its wires: what is set lasts and is seen, and time passes once."""

from dataclasses import replace
from math import nan
from typing import Any

import pytest

from gateway.devices import cell_host, output_host
from gateway.devices.messages import Accepted, AskDevice, DeviceStep, ForceSample, Quality, ReadVoltage, SetVoltage
from gateway.profiles import Rig, load_rig
from gateway.service.simulation import world as world_module
from gateway.service.simulation.world import SimulatedRig
from gateway.twin import Twin
from tests.profile_files import load_device
from tests.service.rigs import demo


class World(SimulatedRig):
    """With what it sends, as the gateway's ends read it."""

    def __init__(self, rig: Rig) -> None:
        self.from_output, self.from_cell = b"", b""
        self.output, self.cell = (
            output_host(rig.output.device),
            cell_host(rig.load_cell.device, unit=rig.load_cell.unit),
        )
        self.at_s = 100.0
        super().__init__(rig, send_output=self._hear_output, send_cell=self._hear_cell, now_s=self.at_s)

    def _hear_output(self, data: bytes) -> None:
        self.from_output += data

    def _hear_cell(self, data: bytes) -> None:
        self.from_cell += data

    def ask(self, request: Any) -> Any:
        self.from_output = b""
        self.on_output_bytes(self.output.request(request), self.at_s)
        return self.output.receive(self.from_output, self.at_s)

    def wait(self, lasts_s: float) -> None:
        for _ in range(round(lasts_s / 0.5)):
            self.at_s += 0.5
            self.advance(self.at_s)

    def sample(self) -> ForceSample:
        self.from_cell = b""
        self.stream(self.at_s)
        (sample,) = self.cell.receive(self.from_cell, self.at_s)
        assert isinstance(sample, ForceSample)
        return sample

    def set(self, **named: Any) -> None:
        self.simulate({"do": "sim", "set": {name.replace("__", "."): value for name, value in named.items()}})


@pytest.fixture
def world() -> World:
    """Pressing with 4 V."""
    world = World(replace(demo(), seed=5))
    assert world.ask(SetVoltage(4.0))
    world.wait(3.0)
    return world


def test_time_passes_once_never_backwards_and_a_rig_that_was_stopped_does_not_make_up_for_it(world: World) -> None:
    passed = list[float]()
    world.twin.advance = passed.append  # type: ignore[method-assign]
    for now_s in (world.at_s + 0.25, world.at_s + 0.25, world.at_s, world.at_s + 0.5, world.at_s + 3600.0):
        world.advance(now_s)
    assert passed == pytest.approx([0.25, 0.0, 0.0, 0.25, 1.0])


def test_a_question_finds_the_machine_at_its_own_time(world: World) -> None:
    before_pa = float(world.twin.pressure_pa)
    world.ask(SetVoltage(0.0))
    world.at_s += 0.9
    world.ask(ReadVoltage())
    assert float(world.twin.pressure_pa) < 0.2 * before_pa


def test_air_and_contact_that_are_gone_are_gone_from_another_machine_too(world: World) -> None:
    world.set(air__off=True)
    world.fault({"do": "fault", "name": "plant", "values": {"friction.coulomb_n": 2.5}})
    assert world._machine.friction.coulomb_n == world.twin.plant.friction.coulomb_n == 2.5
    world.wait(3.0)
    assert float(world.twin.pressure_pa) < 1e3
    world.set(air__off=False)
    world.fault({"do": "fault", "name": "plant", "on": False})
    assert world.twin.plant == demo().plant
    world.wait(3.0)
    assert float(world.twin.pressure_pa) > 1e5


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ({"friction.coulomb_n": -2.5}, "friction.coulomb_n"),
        ({"friction.colour": 1.0}, "no number of a plant"),
        ({"friction": 1.0}, "no number of a plant"),
        ({"nothing.at_all": 1.0}, "no number of a plant"),
    ],
)
def test_what_no_plant_has_changes_nothing(world: World, values: dict[str, float], told: str) -> None:
    twin = world.twin
    with pytest.raises(ValueError, match=told):
        world.fault({"do": "fault", "name": "plant", "values": values})
    assert world.twin is twin and world._machine == demo().plant


@pytest.mark.parametrize("breaks", [True, False], ids=["does not compute", "measures nothing"])
def test_settings_that_no_machine_can_have_leave_those_of_before(
    world: World, breaks: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Impossible(Twin):
        measured_n = nan  # type: ignore[assignment]

        def press_and_vent(self) -> None:
            if breaks:
                raise OverflowError("too large")

    world.set(creep=0.1)
    before, twin = world.settings, world.twin
    monkeypatch.setattr(world_module, "Twin", Impossible)
    with pytest.raises(ValueError, match="E136 no machine has such a plant"):
        world.set(creep=0.2)
    with pytest.raises(ValueError, match="E136 no machine has such a plant"):
        world.fault({"do": "fault", "name": "plant", "values": {"friction.coulomb_n": 2.5}})
    assert (world.settings, world.twin, world._machine) == (before, twin, demo().plant)


def test_another_machine_has_come_to_what_is_commanded_when_it_takes_over(world: World) -> None:
    held_n = world.sample().force_n
    world.fault({"do": "fault", "name": "plant", "values": {"cell.noise_n": 0.0}})
    assert world.sample().force_n == pytest.approx(held_n, abs=1.0)


def test_a_frozen_cell_repeats_what_it_said_whatever_the_machine_does(world: World) -> None:
    before = world.sample()
    world.set(cell__frozen=True)
    world.ask(SetVoltage(0.0))
    world.wait(2.0)
    assert world.sample().force_n == before.force_n != 0.0
    world.set(cell__frozen=False)
    assert world.sample().force_n < 0.3 * before.force_n


@pytest.mark.parametrize("inverted", [False, True])
def test_a_cell_beyond_its_range_says_so_at_either_end(world: World, inverted: bool) -> None:
    held_n = world.sample().force_n
    for share, is_beyond in (
        (0.9, False),
        (1.1, True),
        (30.0, True),
    ):  # of its range, and more than its display has room for
        world.set(cell__scale=share * world._range_n / held_n, cell__inverted=inverted)
        world.wait(0.5)  # else it shows what it has measured before
        assert (world.sample().quality is Quality.OVERLOAD) is is_beyond


def test_a_cell_that_is_set_to_kilograms_shows_a_tenth(world: World) -> None:
    held_n = world.sample().force_n
    world.set(cell__kgf=True)
    shown = [world.sample().force_n for _ in range(20)]
    assert sum(shown) / 20 == pytest.approx(held_n / 9.80665, abs=0.3)
    assert len(set(shown)) > 1, "its last digit is as restless as before"


def test_noise_of_the_whole_wire_spoils_one_bit_of_each_byte_and_none_without(world: World) -> None:
    sent = bytes(range(256)) * 4
    assert world._through_noise(sent) == sent
    world.set(wire__noise=1.0)
    spoiled = world._through_noise(sent)
    assert {(was ^ became).bit_count() for was, became in zip(sent, spoiled, strict=True)} == {1}
    assert len({was ^ became for was, became in zip(sent, spoiled, strict=True)}) == 8
    world.set(wire__noise=0.5)
    assert 300 < sum(was != became for was, became in zip(sent, world._through_noise(sent), strict=True)) < 700


def test_an_output_whose_own_watchdog_trips_goes_to_nothing() -> None:
    device = load_device("icpdas-702x")
    rig = replace(demo(), output=replace(demo().output, device=device))
    world = World(rig)
    for step in world.output.checks:
        if step is not DeviceStep.DISARM:
            world.ask(AskDevice(step))
    world.ask(SetVoltage(4.0))
    assert device.own_watchdog
    world.wait(device.own_watchdog.time_s + 2.0)
    assert world._setting_v == 0.0
    assert float(world.twin.pressure_pa) < 1e4


def test_an_output_adds_what_it_is_set_to_within_its_range(world: World) -> None:
    world.set(output__alter=0.5)
    for asked_v, done_v in ((4.0, 4.5), (9.9, 10.0)):
        (reply,) = world.ask(SetVoltage(asked_v))
        assert reply == Accepted(pytest.approx(done_v, abs=0.01))


def test_noise_before_a_question_to_the_valve_costs_no_answer() -> None:
    pulls = World(load_rig("paper-pull", simulated=True))
    question = bytes.fromhex("0101000000083DCC")
    clean = pulls.on_valve_bytes(question, pulls.at_s)
    assert clean and pulls.on_valve_bytes(b"\xff\xfe\xfd\xfc\xfb\xfa\xf9\xf8\xf7" + question, pulls.at_s) == clean
    assert World(demo()).on_valve_bytes(question, 100.0) == b""


def test_without_a_workpiece_nothing_is_pressed_and_exchanged_wires_show_a_push_as_a_pull(world: World) -> None:
    held_n = world.sample().force_n
    world.set(cell__inverted=True)
    world.wait(0.5)
    assert world.sample().force_n == pytest.approx(-held_n, abs=1.0)
    world.set(cell__inverted=False, contact__off=True)
    world.wait(2.0)
    assert abs(world.sample().force_n) < 0.2 * held_n
    world.set(contact__off=False, cell__scale=2.0)
    world.wait(2.0)
    assert world.sample().force_n == pytest.approx(2.0 * held_n, rel=0.1)


def test_a_valve_takes_its_time_to_move_and_a_stuck_one_never_does() -> None:
    for is_stuck in (False, True):
        pulls = World(load_rig("paper-pull", simulated=True))
        pulls.set(valve__stuck=is_stuck)
        pulls.at_s += 0.5
        assert pulls.on_valve_bytes(bytes.fromhex("01050000FF008C3A"), pulls.at_s)
        signs = []
        for after_s in (0.0, 0.02, 0.04):
            pulls.advance(pulls.at_s + after_s)
            signs.append(pulls.valve.sign)
        assert signs == [1.0, 1.0, 1.0 if is_stuck else -1.0]
        assert pulls._now_s == pulls.at_s + 0.04


def test_what_is_set_lasts_when_the_valve_moves() -> None:
    pulls = World(load_rig("paper-pull", simulated=True))
    pulls.set(air__off=True, cell__noise=0.0)
    assert pulls.ask(SetVoltage(4.0))
    assert pulls.on_valve_bytes(bytes.fromhex("01050000FF008C3A"), pulls.at_s)
    pulls.wait(3.0)
    assert pulls.valve.sign == -1.0
    assert float(pulls.twin.pressure_pa) < 1e3
    pulls.set(air__off=False)
    pulls.wait(3.0)
    assert float(pulls.twin.pressure_pa) > 1e4, "and what is commanded, too"


def test_noise_on_the_wires_reaches_the_valve_too() -> None:
    """Else a cell that is rehearsed with noise has one line that is better than it will be."""
    world = SimulatedRig(load_rig("paper-pull"), send_output=lambda data: None, send_cell=lambda data: None, now_s=0.0)
    question = bytes.fromhex("0101000000083DCC")
    clean = world.on_valve_bytes(question, 0.1)
    assert len(clean) == 6
    world.simulate({"do": "sim", "set": {"wire.noise": 0.5}})
    assert any(world.on_valve_bytes(question, 0.1 + 0.1 * turn) != clean for turn in range(5))
