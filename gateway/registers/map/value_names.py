"""The enumerations of the program that a map file may name instead of listing them: `values: fault_code`, `bits: warning_word`.

So a number has its name in one place. A map may list numbers and names of its own all the same.
"""

from collections.abc import Iterable, Mapping
from enum import IntEnum, IntFlag
from typing import Final

from gateway.bsfm.validate import CoefficientReason
from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.codes.warning_bits import WarningBit
from gateway.registers import words
from gateway.registers.map.register_map import RegisterMap
from gateway.registers.residual_cause import ResidualCause


def _values(*enumerations: type[IntEnum]) -> dict[int, str]:
    return {int(member): member.name.lower() for each in enumerations for member in each}


def _bits(flags: Iterable[IntFlag]) -> dict[int, str]:
    return {int(flag).bit_length() - 1: str(flag.name).lower() for flag in flags}


VALUE_NAMES: Final = {
    "mode": _values(words.Mode),
    "state": _values(words.State),
    "limited_by": _values(words.LimitedBy),
    "fault_code": _values(FaultCode),
    "refusal_reason": _values(RefusalReason),
    "calibration_phase": _values(words.CalibrationPhase),
    "self_test_result": _values(words.SelfTestResult),
    "self_test_verdict": _values(words.SelfTestVerdict),
    "residual_cause": _values(ResidualCause),
    "commit": _values(words.CommitAction),
    "commit_status": _values(words.CommitStatus),
    "failing_reason": _values(CoefficientReason, words.UploadReason),
}
"""Name in a map file -> {number: name}."""

BIT_NAMES: Final = {
    "control_word": _bits(words.ControlBit),
    "status_word": _bits(words.StatusBit),
    "warning_word": _bits(WarningBit),
    "commit_notice": _bits(words.CommitNotice),
    "watchdogs": _bits(words.WatchdogBit),
}
"""Name in a map file -> {bit: name}."""


def check_numbers(register_map: RegisterMap) -> None:
    """Check that no name of the program's own enumerations has another number here: clients and people would take the map's,
    the gateway its own. ValueError. Names that the program does not know are the map's own words."""
    for register in register_map.registers:
        for kind, known, given in (("value", VALUE_NAMES, register.values), ("bit", BIT_NAMES, register.bits)):
            _check_numbers_of(f"{register.name} has {kind}", known.get(register.name, {}), given)


def _check_numbers_of(register: str, known: Mapping[int, str], given: Mapping[int, str]) -> None:
    numbers = {name: number for number, name in known.items()}
    for number, name in given.items():
        if numbers.get(name, number) != number:
            raise ValueError(f"{register} {number} as {name}, which is {numbers[name]} of a gateway")
