"""Each shipped output with each shipped load cell, as a rig file that `check` accepts and `run --sim` simulates: 10 N."""

from pathlib import Path

import pytest

from gateway.devices import DeviceProfile, DeviceRole
from gateway.profiles import list_shipped, load_device
from gateway.profiles.rigs.assembly import check_report
from gateway.registers.words import State
from tests.service.wired import ENABLE, Wired

PROFILES = [load_device(name) for name in list_shipped("device")]
OUTPUTS = [profile for profile in PROFILES if profile.role is DeviceRole.OUTPUT]
CELLS = [profile for profile in PROFILES if profile.role is DeviceRole.LOAD_CELL]
COUNTS_N = {"adam-4016": 10.0}  # its count is a millivolt; the others' is 0.01 N
UNIT = {"mantracourt-dsc": "unit: N"}
RIG = """name: pair
plant: paper-slide
calibration: demo
output: {{device: {output.name}, baud: {output.serial.baud}, port: /dev/serial/by-id/output}}
load_cell: {{device: {cell.name}, baud: {cell.serial.baud}, port: /dev/serial/by-id/cell, range_n: 98.07{more}}}
limits: {{force_max_n: 50, over_force_n: 65, voltage_max_v: 8}}
supervision: {{sample_timeout_s: {timeout_s}, output_timeout_s: 0.3}}
accept_no_device_watchdog: {unwatched}
"""


def text_of(output: DeviceProfile, cell: DeviceProfile) -> str:
    says_unit = cell.reading.unit or cell.reading.template.field("unit")
    more = "" if says_unit else f", {UNIT.get(cell.name) or f'newton_per_count: {COUNTS_N.get(cell.name, 0.01)}'}"
    unwatched = "true" if output.watchdog == "none" else "false"
    return RIG.format(output=output, cell=cell, more=more, timeout_s=0.25, unwatched=unwatched)


@pytest.mark.sampled
@pytest.mark.parametrize("number", range(len(OUTPUTS)))
def test_a_pair_is_a_rig_that_presses_when_it_is_simulated(number: int, tmp_path: Path, budget: int) -> None:
    """In the gate each output with one load cell, so that each load cell has its turn; with --long with all of them."""
    output = OUTPUTS[number]
    cells = CELLS if budget > 1 else [CELLS[(number + 3) % len(CELLS)]]
    for cell in cells:
        file = tmp_path / f"{output.name}-{cell.name}.yaml"
        file.write_text(text_of(output, cell))
        assert not check_report(file).faults
        rig = check_report(file, simulated=True).rig
        assert rig
        wired = Wired(rig)
        wired.until(lambda wired=wired: bool(wired.word("status_word") & 2), 3.0)
        wired.write(0, ENABLE, 1000)
        wired.until(lambda wired=wired: wired.state is State.HOLDING, 5.0)
        wired.run(0.5)
        assert wired.force_n == pytest.approx(10.0, abs=1.0), (output.name, cell.name)
