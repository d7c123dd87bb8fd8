"""Each shipped output and load cell in a whole rig, in virtual time: over its own wire it presses and measures."""

from dataclasses import replace

import pytest

from gateway.devices import DeviceProfile, DeviceRole
from gateway.profiles import CellLine, OutputLine, Rig, list_shipped, load_device
from gateway.registers.words import State
from tests.service.rigs import demo
from tests.service.wired import ENABLE, Wired

PROFILES = {name: load_device(name) for name in list_shipped("device")}
NEWTON_PER_COUNT = {"adam-4016": 10.0}  # its count is a millivolt; the others' is 0.01 N
PRESSING = [name for name, profile in PROFILES.items() if profile.role is not DeviceRole.VALVE]


def rig_with(profile: DeviceProfile) -> Rig:
    """The demo with this device in it, its bounds wide enough for the slowest."""
    rig = demo()
    supervision = replace(rig.control.supervision, sample_timeout_s=0.6, output_timeout_s=0.6)
    rig = replace(rig, control=replace(rig.control, supervision=supervision))
    if profile.role is DeviceRole.OUTPUT:
        return replace(rig, output=OutputLine(device=profile, port=None, baud=profile.serial.baud))
    reading, key = profile.reading, "stream" if profile.stream else "read_force"
    says_unit = bool(reading.unit or reading.template.field("unit"))
    if not says_unit and not profile.name.startswith("mantracourt"):
        counts = replace(reading, newton_per_count=NEWTON_PER_COUNT.get(profile.name, 0.01))
        profile = replace(profile, **{key: counts})  # type: ignore[arg-type]
        says_unit = True
    unit = None if says_unit else "N"
    line = CellLine(device=profile, port=None, baud=profile.serial.baud, sign=1, unit=unit, range_n=98.07)
    return replace(rig, load_cell=line)


@pytest.mark.sampled
@pytest.mark.parametrize("name", PRESSING)
def test_a_device_presses_and_measures_in_a_whole_rig(name: str) -> None:
    wired = Wired(rig_with(PROFILES[name]))
    wired.until(lambda: bool(wired.word("status_word") & 2), 3.0)
    opened = wired.loop.cell_counts.garbled  # of bare numbers the first may be the rest of one
    wired.write(0, ENABLE, 1200)
    wired.until(lambda: wired.state is State.HOLDING, 5.0)
    wired.run(0.5)
    assert wired.force_n == pytest.approx(12.0, abs=1.0)
    assert (wired.exchange.counts.garbled, wired.loop.cell_counts.garbled) == (0, opened)
    assert opened <= 1
    assert wired.exchange.checks.is_armed is bool(wired.rig.output.device.own_watchdog)
