"""From a rig's name to a `Rig`, or to everything that keeps it from being one: what `force-gateway check` prints."""

import hashlib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from shlex import quote
from typing import Final, TypeVar

from gateway import defaults
from gateway.control.compensation.compensation import NO_COMPENSATION, Compensation
from gateway.control.settings import (
    ControlSettings,
    Defaults,
    LeadSettings,
    Limits,
    ResponseSource,
    SelfTestSettings,
    Supervision,
    Trim,
)
from gateway.devices import DeviceProfile
from gateway.profiles.find import display, shipped_profiles_folder
from gateway.profiles.http_sections import Metrics, OpcUa, Web, without_secrets
from gateway.profiles.kinds.calibrations import read_calibration
from gateway.profiles.kinds.devices import read_device
from gateway.profiles.kinds.plants import PlantProfile, read_plant
from gateway.profiles.kinds.registers import read_served_registers
from gateway.profiles.load import load_plant, open_profile, read_named, refer_at, refer_to
from gateway.profiles.recordings_section import service_sections_of
from gateway.profiles.rigs.checks.all_checks import FAULTS, HARDWARE, WARNINGS
from gateway.profiles.rigs.checks.parts import Check, Parts
from gateway.profiles.rigs.checks.tls import check_tls_days
from gateway.profiles.rigs.compensated_effects import (
    compensation_of,
    compensation_words,
    in_simulation,
    without_compensable,
)
from gateway.profiles.rigs.device_settings import LineFile, find_unfit_settings, set_device
from gateway.profiles.rigs.edit_marks import find_edit_marks
from gateway.profiles.rigs.faces import Face, TlsFace
from gateway.profiles.rigs.rig import ALWAYS_SUPPORTED, CellLine, OutputLine, Rig, ValveLine
from gateway.profiles.rigs.rig_file import CellFile, Network, OutputFile, RigFile, ValveFile
from gateway.profiles.strict_yaml.faults import Findings, ProfileError, ProfileFault
from gateway.profiles.strict_yaml.text import Document
from gateway.profiles.strict_yaml.typed import build, build_known
from gateway.profiles.telemetry_sections import Mqtt
from gateway.registers.map.register_map import RegisterMap
from gateway.registers.words import ControlBit

T = TypeVar("T")
Reader = Callable[[Document], tuple[T | None, list[ProfileFault]]]

FALLBACK_PLANT: Final = defaults.PLANT
"""What `run --sim` simulates for a real rig that names no plant."""


@dataclass(frozen=True, slots=True)
class Report:
    """faults: what must be fixed before the rig starts; warnings: what may be meant so; rig: None while there are faults.
    With `simulated` the faults are those that keep even a simulated run from starting."""

    faults: tuple[ProfileFault, ...]
    warnings: tuple[ProfileFault, ...]
    rig: Rig | None


def check_report(name: str | Path, *, simulated: bool = False) -> Report:
    """Read and check a rig, by shipped name or path. Never raises for what is in a file.

    simulated: its devices will be simulated, so no port is needed; rig is `as_simulated` then. One whose file says so itself
    serves its masters on the ports that it names, and those are judged as ever.
    """
    rig, findings = _read(name)
    needs_no_port = simulated and not (rig and rig.simulated)
    faults = findings.faults + ([] if needs_no_port else findings.hardware)
    if rig and simulated:
        rig = replace(rig, notes=(*rig.notes, *_left_to_edit(findings))).as_simulated()
    return Report(_in_order(faults), _in_order(findings.warnings), None if faults else rig)


def _left_to_edit(findings: Findings) -> Iterator[str]:
    """Yield what a simulated run need not mind, and the real one will."""
    for fault in _in_order(findings.hardware):
        yield f"to be edited before it runs without --sim: {fault}"


def load_rig(name: str | Path, *, simulated: bool = False) -> Rig:
    """Return a rig by shipped name or path; ProfileError with every fault. simulated: as in `check_report`."""
    report = check_report(name, simulated=simulated)
    if report.rig is None:
        raise ProfileError(report.faults)
    return report.rig


def read_rig(name: str | Path) -> Rig:
    """Return a rig as its files have it, for who opens none of its ports: one that is still to be edited, and is rehearsed
    meanwhile, has a map, limits, a plant and a calibration all the same. ProfileError with every other fault."""
    rig, findings = _read(name)
    if rig is None or findings.faults:
        raise ProfileError(_in_order(findings.faults))
    return rig


def _read(name: str | Path) -> tuple[Rig | None, Findings]:
    """Return the rig, None where a part of it is missing, and all that was found in its files."""
    findings = Findings()
    opened = open_profile("rig", refer_to(name), findings)
    return (_rig(opened[0], opened[1], findings) if opened else None), findings


def _in_order(faults: Iterable[ProfileFault]) -> tuple[ProfileFault, ...]:
    """File by file as they were read, each from top to bottom, nothing twice."""
    files = list(dict.fromkeys(fault.file for fault in faults))
    return tuple(sorted(dict.fromkeys(faults), key=lambda fault: (files.index(fault.file), fault.line, fault.column)))


def _rig(document: Document, path: Path, findings: Findings) -> Rig | None:
    """Return the rig of a document; None, with the faults noted, when a part is missing."""
    file, faults = build(RigFile, document)
    findings.faults += faults
    named = refer_at(document, ("registers",), path.parent, defaults.REGISTER_MAP)
    register_map = read_named("registers", named, read_served_registers, findings)
    mqtt = _optional_part(document, "mqtt", Mqtt)
    parts = replace(_parts(document, path.parent, findings), register_map=register_map, mqtt=mqtt)
    findings.faults += _first_of_each_path(_run_checks(document, FAULTS, parts))
    findings.hardware += _first_of_each_path(_run_checks(document, HARDWARE, parts))
    findings.warnings += _run_checks(document, WARNINGS, parts)
    marks = _marks(document, path, findings)
    findings.warnings += marks
    if file is None or register_map is None or findings.faults:
        return None
    rig = _assemble_rig(file, parts, register_map, path, findings)
    if not marks:
        return rig
    lines = ", ".join(str(fault.line) for fault in marks)
    what = f"lines {lines} are" if len(marks) > 1 else f"line {lines} is"
    return replace(
        rig,
        notes=(*rig.notes, f"{what} still marked EDIT: force-gateway check {quote(display(path))} says what each is"),
    )


def _marks(document: Document, path: Path, findings: Findings) -> list[ProfileFault]:
    """Marks of a rig of the user's own; a placeholder is told already, and a shipped file is there to be copied."""
    if path.is_relative_to(shipped_profiles_folder()):
        return []
    known_paths = {fault.path for fault in (*findings.faults, *findings.hardware)}
    text = findings.texts[display(path)].decode("utf-8-sig", "replace")
    return [fault for fault in find_edit_marks(document, text) if fault.path not in known_paths]


def _run_checks(document: Document, found_by: Iterable[Check], parts: Parts) -> list[ProfileFault]:
    return [document.fault(_steps(path), sentence) for check in found_by for path, sentence in check(parts)]


def _first_of_each_path(faults: list[ProfileFault]) -> list[ProfileFault]:
    """Return the first fault of each place: what is wrong there in two ways has one cause, usually the first."""
    return list({fault.path: fault for fault in reversed(faults)}.values())[::-1]


def _steps(path: str) -> tuple[str | int, ...]:
    return tuple(int(step) if step.isdecimal() else step for step in path.split("."))


def _parts(document: Document, folder: Path, findings: Findings) -> Parts:
    """Return what can be checked together: every part that has no fault of its own."""

    def read_part(kind: str, path: tuple[str, ...], read: Reader[T]) -> T | None:
        return read_named(kind, refer_at(document, path, folder), read, findings)

    output, load_cell = _part(document, "output", OutputFile), _part(document, "load_cell", CellFile)
    valve = _optional_part(document, "valve", ValveFile)
    output_device, cell_device = (read_part("device", (key, "device"), read_device) for key in ("output", "load_cell"))
    plant, extended = (read_part("plant", (key,), read_plant) for key in ("plant", "compensation"))
    return Parts(
        name=str(document.at("name")),
        simulated=document.at("simulated") is True,
        names_plant=("plant",) in document.marks,
        accept_no_device_watchdog=document.at("accept_no_device_watchdog") is True,
        loop_hz=_loop_hz(document),
        output=output,
        load_cell=load_cell,
        limits=_part(document, "limits", Limits),
        defaults=_part(document, "defaults", Defaults),
        trim=_part(document, "trim", Trim),
        lead=_part(document, "lead", LeadSettings),
        measures_response=document.at("response") != ResponseSource.RIG,
        supervision=_part(document, "supervision", Supervision),
        valve=valve,
        valve_device=_as_set(read_part("device", ("valve", "device"), read_device), valve),
        valve_calibration=read_part("calibration", ("valve", "calibration"), read_calibration),
        self_test=_optional_part(document, "self_test", SelfTestSettings),
        network=_part(document, "network", Network),
        web=_optional_part(document, "web", Web),
        metrics=_optional_part(document, "metrics", Metrics),
        opcua=_optional_part(document, "opcua", OpcUa),
        fieldbus=_faces(document, folder),
        calibration=read_part("calibration", ("calibration",), read_calibration),
        output_device=_as_set(output_device, output),
        cell_device=_as_set(cell_device, load_cell),
        plant=plant,
        extended=extended,
        compensation=_compensation(plant, extended),
    )


def _loop_hz(document: Document) -> float | None:
    loop_hz = document.at("loop_hz") if ("loop_hz",) in document.marks else defaults.LOOP_HZ
    return float(loop_hz) if isinstance(loop_hz, (int, float)) else None


def _as_set(device: DeviceProfile | None, line: LineFile | None) -> DeviceProfile | None:
    """The device with the rig's settings; as it is where they do not fit, which check_device_settings tells."""
    if device is None or line is None or list(find_unfit_settings(device, line)):
        return device
    return set_device(device, line)


def _compensation(plant: PlantProfile | None, extended: PlantProfile | None) -> Compensation | None:
    """Of what differs from the rig's plant, and of what control could take back of that one, too."""
    if extended is None:
        return None
    base = (plant or load_plant(FALLBACK_PLANT)).plant
    return compensation_of(without_compensable(base), extended.plant)


def _optional_part(document: Document, key: str, kind: type[T]) -> T | None:
    """Return one group of the file by itself; None where the file leaves it out, or says null."""
    return _part(document, key, kind) if document.at(key) is not None else None


def _part(document: Document, key: str, kind: type[T]) -> T | None:
    """Return one group of the file by itself; its defaults where the file leaves it out."""
    if (key,) in document.marks:
        return build_known(kind, document, (key,))
    try:
        return kind()
    except TypeError:  # it has keys without a default
        return None


def _faces(document: Document, folder: Path) -> tuple[Face | None, ...]:
    """Return the rig's faces in their order, each None where it has a fault of its own."""
    listed = document.at("fieldbus") if ("fieldbus",) in document.marks else ()
    count = len(listed) if isinstance(listed, list) else 0
    faces = (build_known(Face, document, ("fieldbus", index)) for index in range(count))  # type: ignore[arg-type]
    return tuple(face.within(folder) if isinstance(face, TlsFace) else face for face in faces)


def _assemble_rig(file: RigFile, parts: Parts, register_map: RegisterMap, path: Path, findings: Findings) -> Rig:
    assert parts.output_device and parts.cell_device and parts.calibration  # or there were faults
    compensation = parts.compensation or NO_COMPENSATION
    compensation = in_simulation(compensation) if file.simulated else compensation
    return Rig(
        name=file.name,
        description=file.description,
        file=path,
        simulated=file.simulated,
        seed=file.seed,
        loop_hz=file.loop_hz,
        register_map=register_map,
        output=OutputLine.of(parts.output_device, file.output.port, file.output.baud),
        load_cell=_cell_line(file.load_cell, parts.cell_device),
        plant_profile=parts.plant,
        fallback_plant=None if parts.plant else load_plant(FALLBACK_PLANT),
        calibration=parts.calibration,
        control=_control_settings(file),
        valve=_valve_line(file.valve, parts.valve_device) if file.valve and parts.valve_device else None,
        pull_calibration=parts.valve_calibration,
        network=file.network,
        fieldbus=tuple(face for face in parts.fieldbus if face),
        residual_watch=file.residual_watch,
        **service_sections_of(file),
        supported_bits=_supported_bits(file),
        accept_no_device_watchdog=file.accept_no_device_watchdog,
        texts=_texts(findings),
        fingerprint=_fingerprint(findings.texts.values()),
        notes=_notes(parts, compensation),
        compensation=compensation,
    )


def _control_settings(file: RigFile) -> ControlSettings:
    return ControlSettings(
        limits=file.limits,
        defaults=file.defaults,
        trim=file.trim,
        lead=file.lead,
        response=file.response,
        supervision=file.supervision,
        self_test=file.self_test,
        valve=file.valve.control if file.valve else None,
    )


def _texts(findings: Findings) -> dict[str, str]:
    return {name: without_secrets(text.decode("utf-8-sig")) for name, text in findings.texts.items()}


def _notes(parts: Parts, compensation: Compensation) -> tuple[str, ...]:
    days = (sentence for _, sentence in check_tls_days(parts))
    return (*(compensation_words(compensation) if parts.compensation else ()), *days)


def _supported_bits(file: RigFile) -> ControlBit:
    self_test = ControlBit.START_SELF_TEST if file.self_test else ControlBit(0)
    return ALWAYS_SUPPORTED | self_test | (ControlBit.VALVE_PULL if file.valve else ControlBit(0))


def _valve_line(valve: ValveFile, device: DeviceProfile) -> ValveLine:
    return ValveLine.of(device, valve.port, valve.baud)


def _cell_line(cell: CellFile, device: DeviceProfile) -> CellLine:
    return CellLine.of(device, cell.port, cell.baud, sign=cell.sign, unit=cell.unit, range_n=cell.range_n)


def _fingerprint(texts: Iterable[bytes]) -> str:
    """Return the SHA-256 over every text in the order of reading, each with its length before it."""
    digest = hashlib.sha256()
    for text in texts:
        digest.update(len(text).to_bytes(8, "big") + text)
    return digest.hexdigest()
