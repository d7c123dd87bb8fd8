"""What the control socket's verbs take at the bounds of each field, and what no handler ever sees."""

from math import inf, nan
from typing import Any

import pytest

from gateway.service.socket_requests import (
    CalibrateRequest,
    CalibrationRequest,
    EmptyRequest,
    FaultRequest,
    ModbusRequest,
    PlantRequest,
    RecordRequest,
    ResidualRequest,
    SimulationRequest,
    parse_request,
)

MONTH_S = 31 * 86400.0
MODBUS = {"via": "web", "pdu": "03"}
BOUNDS: tuple[tuple[type, dict[str, Any], dict[str, Any]], ...] = (
    (EmptyRequest, {}, {"more": 1}),
    (RecordRequest, {"for_s": 0.0}, {"for_s": -1.0e-3}),
    (RecordRequest, {"for_s": MONTH_S}, {"for_s": MONTH_S + 1.0}),
    (RecordRequest, {"for_s": 1}, {"for_s": inf}),
    (RecordRequest, {}, {"for_s": nan}),
    (RecordRequest, {"name": 60 * "n"}, {"name": 61 * "n"}),
    (RecordRequest, {"note": 1000 * "n"}, {"note": 1001 * "n"}),
    (RecordRequest, {"note": "two\nlines"}, {"note": "\x1b[2J"}),
    (RecordRequest, {}, {"on": None}),
    (RecordRequest, {"on": True}, {"on": 1}),
    (CalibrationRequest, {"use": 0}, {"use": -1}),
    (CalibrationRequest, {"use": 999_999}, {"use": 1_000_000}),
    (PlantRequest, {"use": 0}, {"use": True}),
    (CalibrateRequest, {"continues": [1] * 1000}, {"continues": [1] * 1001}),
    (CalibrateRequest, {"continues": [0]}, {"continues": [-1]}),
    (CalibrateRequest, {"name": 60 * "n"}, {"name": 61 * "n"}),
    (ResidualRequest, {"cause": 0}, {"cause": -1}),
    (FaultRequest, {"name": "air"}, {"name": "air", "values": {"contact.gap_m": inf}}),
    (SimulationRequest, {"set": {100 * "n": 1.0}}, {"set": {101 * "n": 1.0}}),
    (SimulationRequest, {"set": {"creep": "on"}}, {"set": {"creep": nan}}),
    (SimulationRequest, {"clear": ["n"] * 200}, {"clear": ["n"] * 201}),
    (ModbusRequest, MODBUS | {"unit": 0}, MODBUS | {"unit": -1}),
    (ModbusRequest, MODBUS | {"unit": 255}, MODBUS | {"unit": 256}),
    (ModbusRequest, MODBUS | {"pdu": 506 * "0"}, MODBUS | {"pdu": 507 * "0"}),
    (ModbusRequest, MODBUS, MODBUS | {"via": "tcp"}),
)


@pytest.mark.parametrize(("shape", "taken", "refused"), BOUNDS, ids=range(len(BOUNDS)))
def test_each_field_is_taken_up_to_its_bound_and_refused_beyond_it(
    shape: type, taken: dict[str, Any], refused: dict[str, Any]
) -> None:
    assert isinstance(parse_request(shape, {"do": "verb"} | taken), shape)
    key = next(name for name, value in refused.items() if name not in taken or value is not taken[name])
    with pytest.raises(ValueError, match=key):
        parse_request(shape, {"do": "verb"} | refused)


def test_what_is_left_out_asks_for_nothing_more() -> None:
    """Above all: a rejected calibration is used for who says so, and a run is begun and not stopped."""
    used = parse_request(CalibrationRequest, {"do": "calibration", "use": 3})
    assert (used.force, used.rollback) == (False, False)
    asked = parse_request(CalibrateRequest, {"do": "calibrate"})
    assert (asked.plan, asked.stop, asked.dry_run) == (None, False, False)
    recorded = parse_request(RecordRequest, {"do": "record"})
    assert (recorded.on, recorded.for_s) == (None, 0.0)
