"""What control publishes, in three faces; what is not available says so."""

import math
import struct
from copy import deepcopy

import pytest

from gateway.codes.faults import FaultCode
from gateway.registers import BankRules, RegisterBank, RegisterMap, Status
from gateway.registers.map.map_reader import read_map
from gateway.registers.words import LimitedBy, State

FULL = Status(
    state=State.HOLDING,
    status_word=0x0F,
    force_measured_n=12.344,
    force_requested_n=12.006,
    force_accepted_n=11.0,
    force_applied_n=10.0,
    output_voltage_v=2.87,
    feedforward_v=2.9,
    trim_v=-0.03,
    limited_by=LimitedBy.TRIM_RANGE,
    fault_code=FaultCode.OVER_FORCE,
    warning_word=0x41,
    sample_age_s=0.0042,
    loop_time_s=123e-6,
    heartbeat_echo=65535,
    sequence_echo=77,
    calibration_id=16,
    model_residual_n=-0.506,
    pressure_pa=251_400.0,
    missed_ticks=3,
)
SHOWN = {
    "status_word": 0x0F,
    "state": 3,
    "force_measured": 12.34,
    "force_requested": 12.01,
    "force_accepted": 11.0,
    "force_applied": 10.0,
    "output_voltage": 2870,
    "feedforward": 2900,
    "trim": -30,
    "limited_by": 3,
    "fault_code": 4,
    "warning_word": 0x41,
    "sample_age": 4,
    "loop_time": 123,
    "heartbeat_echo": 65535,
    "sequence_echo": 77,
    "calibration_id": 16,
    "model_residual": -0.51,
    "pressure": 251,
    "missed_ticks": 3,
}


def shown(bank: RegisterBank, register_map: RegisterMap, name: str) -> float:
    register = register_map.find(name)
    return register.decode(bank.read_registers(register.address, register.words))


def test_every_published_quantity_is_where_the_map_says(bank, register_map):
    bank.publish(FULL)
    for name, value in SHOWN.items():
        assert shown(bank, register_map, name) == pytest.approx(value), name
        exact = shown(bank, register_map, f"{name}@float_abcd")
        assert exact == shown(bank, register_map, f"{name}@float_cdab")
        assert exact == pytest.approx(value, abs=0.51 * register_map.find(name).scale), name
    assert shown(bank, register_map, "force_measured@float_abcd") == pytest.approx(12.344)


def test_a_status_is_put_together_once_by_the_read_that_asks_for_it(bank, register_map):
    asked = []

    def tell(force_n: float) -> Status:
        asked.append(force_n)
        return Status(force_measured_n=force_n)

    bank.publish_when_read(State.OFF, lambda: tell(1.0))
    bank.publish_when_read(State.OFF, lambda: tell(2.0))
    assert not asked, "nobody has read"
    assert [shown(bank, register_map, "force_measured") for _ in range(3)] == [2.0, 2.0, 2.0]
    assert asked == [2.0]


def test_before_the_first_publish_nothing_is_claimed(bank, register_map):
    for name in ("force_measured", "output_voltage", "sample_age", "pressure", "model_residual"):
        assert math.isnan(shown(bank, register_map, name)), name
        assert math.isnan(shown(bank, register_map, f"{name}@float_cdab")), name
    assert bank.read_registers(102, 1) == b"\x80\x00"


@pytest.mark.parametrize("missing", [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_is_unavailable(bank, register_map, missing):
    bank.publish(Status(force_measured_n=missing, loop_time_s=missing))
    assert bank.read_registers(102, 1) == bank.read_registers(113, 1) == b"\x80\x00"
    assert math.isnan(shown(bank, register_map, "force_measured@float_abcd"))
    bank.publish(Status(missed_ticks=missing))
    assert shown(bank, register_map, "missed_ticks") == 0, "a counter has no word for it"


def test_a_measured_value_beyond_int16_is_clamped_there_only(bank, register_map):
    bank.publish(Status(force_measured_n=400.0, model_residual_n=-400.0, missed_ticks=70_000, sample_age_s=1e6))
    assert shown(bank, register_map, "force_measured") == 327.67
    assert shown(bank, register_map, "model_residual") == -327.67
    assert shown(bank, register_map, "missed_ticks") == 65535
    assert shown(bank, register_map, "missed_ticks@float_abcd") == 70_000
    assert shown(bank, register_map, "force_measured@float_cdab") == 400.0
    bank.publish(Status(force_measured_n=1e300))
    assert shown(bank, register_map, "force_measured@float_abcd") == pytest.approx(3.4028235e38)


def test_a_number_that_rounds_to_the_word_for_none_is_a_number_still(bank, register_map):
    bank.publish(FULL._replace(force_measured_n=-327.678))
    assert shown(bank, register_map, "force_measured") == -327.67
    assert shown(bank, register_map, "force_measured@float_abcd") == pytest.approx(-327.678)


def test_a_publish_keeps_owner_and_last_refusal(bank, master, register_map):
    master.write(0, 1, 1200)
    master.refusal(master.write, 1, 6500)
    bank.publish(FULL)
    assert shown(bank, register_map, "owner_ip") == 0x0A000001
    assert shown(bank, register_map, "refusal_value") == 65.0
    assert shown(bank, register_map, "refusal_reason@float_abcd") == 5.0
    assert struct.unpack(">f", bank.read_registers(372, 2)[2:] + bank.read_registers(372, 2)[:2]) == (65.0,)


def test_a_publish_writes_into_no_other_block(bank):
    before = [bank.read_registers(*place) for place in ((0, 16), (200, 32), (300, 32), (400, 32), (1500, 100))]
    bank.publish(FULL)
    assert before == [bank.read_registers(*place) for place in ((0, 16), (200, 32), (300, 32), (400, 32), (1500, 100))]


def test_a_map_that_lacks_what_control_publishes_is_no_map_for_a_bank(document):
    poorer = deepcopy(document)
    del poorer["blocks"]["status"]["registers"][2]
    with pytest.raises(ValueError, match="block status lacks force_measured"):
        RegisterBank(read_map(poorer), BankRules(rig_name="x", force_max_n=1.0), now=lambda: 0.0)
    poorer = deepcopy(document)
    poorer["blocks"]["command"]["registers"][1]["name"] = "force"
    with pytest.raises(ValueError, match="block command must hold control_word, force_setpoint"):
        RegisterBank(read_map(poorer), BankRules(rig_name="x", force_max_n=1.0), now=lambda: 0.0)
