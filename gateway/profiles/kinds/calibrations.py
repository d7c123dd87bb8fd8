"""Calibration files: coefficients, checked as an upload over Modbus is checked, each fault at its number."""

from typing import Final

from gateway import defaults
from gateway.bsfm.coefficients import (
    RESPONSE_FROM,
    STRIDE,
    CoefficientFault,
    CoefficientLimits,
    CoefficientReason,
    Coefficients,
)
from gateway.bsfm.model import Calibration
from gateway.bsfm.validate import validate_coefficients
from gateway.profiles.strict_yaml.faults import Path, ProfileFault
from gateway.profiles.strict_yaml.text import Document
from gateway.profiles.strict_yaml.typed import build

_BRANCHES: Final = ("rising_handles_n", "rising_weights", "falling_handles_n", "falling_weights")
_ARRAYS: Final = (*_BRANCHES, "slip_radii_v", "slip_shares")
_RESPONSE: Final = ("dead_time_s", "lag_s", "second_lag_s", "damping")
_OF_ALL_STOPS: Final = (CoefficientReason.SLIP_STOPS, CoefficientReason.SLIP_STIFFNESS)


def read_calibration(document: Document) -> tuple[Calibration | None, list[ProfileFault]]:
    """Return the calibration of a file, or None and every fault."""
    calibration, faults = build(Calibration, document)
    if calibration is None:
        return None, faults
    faults = _length_faults(calibration, document) or coefficient_faults(calibration, document, defaults.LARGEST_CELL_N)
    faults = faults or _model_faults(calibration, document)
    return (None, faults) if faults else (calibration, [])


def coefficient_faults(calibration: Calibration, document: Document, cell_range_n: float) -> list[ProfileFault]:
    """Return what is wrong with coefficients that are to drive a plant with this load cell."""
    limits = CoefficientLimits(cell_range_n=cell_range_n)
    coefficients = Coefficients.of_calibration(calibration)
    return [document.fault(_place(fault), fault.text) for fault in validate_coefficients(coefficients, limits)]


def _length_faults(calibration: Calibration, document: Document) -> list[ProfileFault]:
    wanted = calibration.order + 1
    return [
        document.fault((name,), f"has {len(getattr(calibration, name))} entries: order {wanted - 1} has {wanted}")
        for name in _BRANCHES
        if len(getattr(calibration, name)) != wanted
    ]


def _model_faults(calibration: Calibration, document: Document) -> list[ProfileFault]:
    """Return what only the whole model shows: force limits that are none; and a noise that is none."""
    if not 0.0 <= calibration.noise_n < defaults.LARGEST_CELL_N:
        return [
            document.fault(("noise_n",), f"{calibration.noise_n:g} N: a standard deviation, 0 where it is not known")
        ]
    try:
        calibration.model()
    except ValueError as error:
        return [document.fault(("force_limits_n",) if calibration.force_limits_n else (), str(error))]
    return []


def _place(fault: CoefficientFault) -> Path:
    """Return where a coefficient of the upload's numbering stands in the file; () for the set as a whole."""
    if fault.reason in _OF_ALL_STOPS:
        return ("slip_radii_v",)
    if fault.index < 0:
        return ()
    if fault.index >= RESPONSE_FROM:
        return ("response", _RESPONSE[fault.index - RESPONSE_FROM])
    return (_ARRAYS[fault.index // STRIDE], fault.index % STRIDE)
