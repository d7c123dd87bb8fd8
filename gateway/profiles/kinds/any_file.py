"""`check` of any profile: what a file is, by its keys, and every fault of it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from gateway.profiles.find import FOLDERS, list_shipped
from gateway.profiles.kinds.calibrations import read_calibration
from gateway.profiles.kinds.devices import read_device
from gateway.profiles.kinds.file_kind import keys_at_the_top, kind_of
from gateway.profiles.kinds.plans import AnyPlan, read_plan
from gateway.profiles.kinds.plants import read_plant
from gateway.profiles.kinds.registers import read_registers
from gateway.profiles.load import open_file, refer_to
from gateway.profiles.rigs.assembly import check_report
from gateway.profiles.strict_yaml.faults import Findings, ProfileError, ProfileFault
from gateway.profiles.strict_yaml.text import Document


@dataclass(frozen=True, slots=True)
class Checked:
    """kind: of kinds.CALLED; value: what was read (Rig, DeviceProfile, PlantProfile, Calibration, RegisterMap, a plan), None
    while there are faults."""

    kind: str
    value: Any
    faults: tuple[ProfileFault, ...] = ()
    warnings: tuple[ProfileFault, ...] = ()


def check_file(name: str | Path) -> Checked:
    """Read and check a profile of any kind, by shipped name (a rig's first) or path. Never raises for what is in a file."""
    kind = next((kind for kind in FOLDERS if str(name) in list_shipped(kind)), "rig")
    findings = Findings()
    opened = open_file(kind, replace(refer_to(name), is_of_any_kind=True), findings)
    if opened is None and not findings.texts:  # nothing was read: whoever mistypes a device's file wants that proposed
        return Checked(kind, None, tuple(findings.faults))
    kind = kind_of(opened[0].value if opened else keys_at_the_top(b"".join(findings.texts.values())), kind) or kind
    if kind == "rig":
        report = check_report(name)
        return Checked("rig", report.rig, report.faults, report.warnings)
    if opened is None:
        return Checked(kind, None, tuple(findings.faults))
    value, faults = _READ[kind](opened[0])
    warnings = opened[0].warn_of_glued_comments() if kind == "device" else ()
    return Checked(kind, None if faults else value, tuple(sorted(faults)), tuple(warnings))


def _plan(document: Document) -> tuple[AnyPlan | None, list[ProfileFault]]:
    try:
        return read_plan(document), []
    except ProfileError as error:
        return None, list(error.faults)


_READ: Final[Mapping[str, Callable[[Document], tuple[Any, list[ProfileFault]]]]] = {
    "device": read_device,
    "plant": read_plant,
    "calibration": read_calibration,
    "registers": read_registers,
    "plan": _plan,
}
