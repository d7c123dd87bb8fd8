"""Calibration files: coefficients, checked as an upload over Modbus is checked, each fault at its number."""

from typing import Final

from gateway.bsfm.model import Calibration
from gateway.bsfm.validate import STRIDE, CoefficientLimits, Coefficients, validate_coefficients
from gateway.profiles.faults import Fault, Path
from gateway.profiles.text import Document
from gateway.profiles.typed import build

_LARGEST_CELL_N: Final = 5000.0  # of any rig; each rig has its own cell's range, and checks against that
_ARRAYS: Final = ("rising_handles_n", "rising_weights", "falling_handles_n", "falling_weights")


def read_calibration(document: Document) -> tuple[Calibration | None, list[Fault]]:
    """The calibration of a file, or None and every fault."""
    calibration, faults = build(Calibration, document)
    if calibration is None:
        return None, faults
    faults = _length_faults(calibration, document) or coefficient_faults(calibration, document, _LARGEST_CELL_N)
    faults = faults or _reversal_faults(calibration, document)
    return (None, faults) if faults else (calibration, [])


def coefficient_faults(calibration: Calibration, document: Document, cell_range_n: float) -> list[Fault]:
    """What METHOD demands of coefficients that drive a plant with this load cell."""
    limits = CoefficientLimits(cell_range_n=cell_range_n)
    coefficients = Coefficients(
        calibration.x0_v,
        calibration.x1_v,
        calibration.rising_handles_n,
        calibration.rising_weights,
        calibration.falling_handles_n,
        calibration.falling_weights,
        calibration.blend_span_n,
    )
    return [document.fault(_place(found.index), found.text) for found in validate_coefficients(coefficients, limits)]


def _length_faults(calibration: Calibration, document: Document) -> list[Fault]:
    wanted = calibration.order + 1
    return [
        document.fault((name,), f"has {len(getattr(calibration, name))} entries: order {wanted - 1} has {wanted}")
        for name in _ARRAYS
        if len(getattr(calibration, name)) != wanted
    ]


def _reversal_faults(calibration: Calibration, document: Document) -> list[Fault]:
    """Slip stops that are none, or too stiff for these branches."""
    try:
        calibration.model()
    except ValueError as error:
        return [document.fault(("slip_radii_v",), str(error))]
    return []


def _place(index: int) -> Path:
    """Where a coefficient of the upload's numbering stands in the file; () for the set as a whole."""
    return () if index < 0 else (_ARRAYS[index // STRIDE], index % STRIDE)
