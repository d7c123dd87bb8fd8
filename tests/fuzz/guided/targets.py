"""Every target by its name: what judges an input, and inputs to begin with."""

from collections.abc import Callable
from typing import Final, NamedTuple

from tests.fuzz.guided import coefficient_target, device_targets, document_targets, modbus_targets


class Target(NamedTuple):
    """assert_lawful: raises whatever it raises for an input that shows a defect; longest: bytes of an input that is tried."""

    assert_lawful: Callable[[bytes], None]
    seeds: Callable[[], list[bytes]]
    longest: int


TARGETS: Final = {
    "mbap": Target(modbus_targets.judge_mbap, lambda: modbus_targets.MBAP_SEEDS, 600),
    "bank": Target(modbus_targets.judge_bank, lambda: modbus_targets.BANK_SEEDS, 300),
    "rtu": Target(modbus_targets.judge_rtu, lambda: modbus_targets.RTU_SEEDS, 600),
    "certificate": Target(modbus_targets.judge_certificate, modbus_targets.certificate_seeds, 1500),
    "load-cell": Target(device_targets.judge_cell, device_targets.cell_seeds, 200),
    "output": Target(device_targets.judge_output, device_targets.output_seeds, 200),
    "coefficients": Target(coefficient_target.judge_coefficients, coefficient_target.coefficient_seeds, 400),
    "yaml": Target(document_targets.judge_yaml, document_targets.profile_seeds, 2000),
    "profile": Target(document_targets.judge_profile, document_targets.profile_seeds, 4000),
    "table": Target(document_targets.judge_table, document_targets.table_seeds, 1500),
    "audit": Target(document_targets.judge_audit, document_targets.audit_seeds, 2500),
    "request": Target(document_targets.judge_request, document_targets.request_seeds, 400),
}
