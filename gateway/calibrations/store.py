"""The calibrations of one rig: numbered, immutable, and which of them is in use.

STATE/calibrations holds NNNN.yaml, each in the form of the shipped ones with its CRC-32 in the first line, and the
generations of the selection (gateway.calibrations.selection). Number and content belong together for good; a number that the
rig's built-in calibration has is not given again. Whatever is damaged is named and passed over: the calibration in use,
else the one before it, else the built-in one. There is no clock here: dates come with the calibrations.

The methods wait for the disk. Processes and threads may call them at the same time.
"""

import contextlib
import json
import re
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Final

from gateway.bsfm.model import Calibration, Response
from gateway.calibrations.selection import BUILT_IN, Selection, SelectionState, read_selection, write_selection
from gateway.processes.durable_file import add_checksum, lock_directory, make_directory, verify_checksum, write_durably
from gateway.profiles import ProfileError
from gateway.profiles.kinds.calibrations import read_calibration
from gateway.profiles.strict_yaml.text import parse
from gateway.registers.upload.staging import SLOTS

_NAME: Final = re.compile(r"(\d{4})\.yaml")
_LAST: Final = 9999
UNKNOWN_N: Final = -1.0
"""rms_n and max_n of a calibration whose data nobody has seen: an upload carries coefficients only."""


class StoreError(Exception):
    """A calibration cannot be stored, read or used; what was in use stays. str: the sentence, which begins with its code."""

    def __init__(self, code: str, sentence: str) -> None:
        super().__init__(f"{code} {sentence}")
        self.code = code


@dataclass(frozen=True, slots=True)
class CalibrationEntry:
    """One file of the store; calibration None and a sentence in fault when it is damaged."""

    number: int
    calibration: Calibration | None
    fault: str = ""


@dataclass(frozen=True, slots=True)
class SelectedCalibration:
    """What is in use. calibration None: the built-in one, of a rig that the store was not told. notes: what was passed over."""

    calibration: Calibration | None
    selection: Selection
    pointer: SelectionState
    notes: tuple[str, ...] = ()


Entries = list[CalibrationEntry]
Numbers = list[int]


class CalibrationStore:
    """built_in: the calibration that the rig's file names."""

    def __init__(self, state: Path, built_in: Calibration | None = None) -> None:
        self.directory = state / "calibrations"
        self.built_in = built_in

    def add(self, calibration: Calibration) -> int:
        """Store it under the next number, whatever number it has; return that number. StoreError, and nothing has changed, for
        one that could not be read back or when the disk refuses."""
        try:
            make_directory(self.directory)
            with lock_directory(self.directory) as descriptor:
                number = self._next_number()
                write_durably(descriptor, _file_name(number), _encode_checked(replace(calibration, number=number)))
        except OSError as error:
            raise _store_error(error) from error
        return number

    def list(self) -> Entries:
        """Return every calibration of the store by number, damaged ones with their fault."""
        return [self._entry(number) for number in self._numbers()]

    def iterate_unchecked(self) -> Iterator[tuple[int, Calibration]]:
        """Yield every calibration, the last one first, without checking any: a search through hundreds of them must not
        keep the loop waiting. So `load` what is found; files that cannot be read are left out."""
        for number in reversed(self._numbers()):
            with contextlib.suppress(OSError, ValueError, TypeError):
                yield number, _parse_unchecked((self.directory / _file_name(number)).read_text(encoding="utf-8"))

    def load(self, number: int) -> Calibration:
        """Return a calibration by its number, that of the built-in one included. StoreError when it is not there or damaged."""
        path = self.directory / _file_name(number)
        try:
            calibration = _parse_checked(path.read_bytes(), path)
        except FileNotFoundError:
            return self._built_in(number)
        except OSError as error:
            raise StoreError("E432", f"{path} cannot be read: {error.strerror}") from None
        if calibration.number != number:
            raise StoreError("E432", f"{path} says that it is calibration {calibration.number}")
        return calibration

    def number_of(self, data_sha256: str) -> int | None:
        """Return the calibration that was made of these very data, None where there is none."""
        return next((e.number for e in self.list() if e.calibration and e.calibration.data_sha256 == data_sha256), None)

    def find_selected(self, why_unusable: Callable[[Calibration], str] = lambda calibration: "") -> SelectedCalibration:
        """Return the calibration in use: the active one, else the previous, else the built-in.

        why_unusable: a sentence for one that is not fit for this rig, empty for one that is.
        """
        pointer, notes = self._pointer()
        for selection in (pointer.active, pointer.previous):
            if selection.number is None:
                return SelectedCalibration(self.built_in, selection, pointer, notes)
            try:
                calibration = self.load(selection.number)
                fault = why_unusable(calibration)
            except StoreError as error:
                fault = str(error)
            if not fault:
                return SelectedCalibration(calibration, selection, pointer, notes)
            notes = (*notes, f"{fault}; the one before it is used instead of calibration {selection.number}")
        return SelectedCalibration(self.built_in, BUILT_IN, pointer, notes)

    def use(self, number: int | None, slot: int | None = None) -> SelectionState:
        """Put this calibration in use, None: the built-in one; a slot given is filled with it. StoreError, and nothing has
        changed, for one that cannot be loaded or when the disk refuses."""
        if number is not None and self.load(number) is self.built_in:
            number = None
        if slot is not None and not 0 <= slot < SLOTS:
            raise StoreError("E433", f"slot {slot}: there are 0 .. {SLOTS - 1}")
        return self._change(Selection(number, slot))

    def previous(self) -> Selection:
        """Return what a rollback brings back. StoreError where nothing was ever changed."""
        pointer, _ = self._pointer()
        if pointer.generation == 0:
            raise StoreError("E433", "no calibration was in use before this one: there is nothing to go back to")
        previous = pointer.previous
        is_in_slot = previous.slot is not None and pointer.in_slot(previous.slot) == previous
        return previous if is_in_slot else Selection(previous.number)

    def _change(self, selection: Selection) -> SelectionState:
        try:
            make_directory(self.directory)
            with lock_directory(self.directory) as descriptor:
                pointer, _ = read_selection(self.directory)
                changed = pointer.with_active(selection, self._to_go_back_to(pointer, selection))
                return write_selection(self.directory, descriptor, changed)
        except OSError as error:
            raise _store_error(error) from error

    def _to_go_back_to(self, pointer: SelectionState, selection: Selection) -> Selection:
        """Return what is in use now, unless it is damaged or is chosen again: then what could be gone back to stays."""
        active = pointer.active
        if active.number == selection.number or (active.number is not None and self._entry(active.number).fault):
            return pointer.previous
        return active

    def _pointer(self) -> tuple[SelectionState, tuple[str, ...]]:
        try:
            with lock_directory(self.directory, shared=True):
                return read_selection(self.directory)
        except FileNotFoundError:
            return SelectionState(), ()
        except OSError as error:
            return SelectionState(), (
                f"E432 {self.directory} cannot be read: {error.strerror}; built-in calibration used",
            )

    def _entry(self, number: int) -> CalibrationEntry:
        try:
            return CalibrationEntry(number, self.load(number))
        except StoreError as error:
            return CalibrationEntry(number, None, str(error))

    def _built_in(self, number: int) -> Calibration:
        if self.built_in is not None and self.built_in.number == number:
            return self.built_in
        known = ", ".join(map(str, self._numbers())) or "none yet"
        raise StoreError("E433", f"there is no calibration {number} in {self.directory}; there are: {known}")

    def _numbers(self) -> Numbers:
        names = [path.name for path in self.directory.iterdir()] if self.directory.is_dir() else []
        return sorted(int(match[1]) for name in names if (match := _NAME.fullmatch(name)))

    def _next_number(self) -> int:
        spoken_of, _ = read_selection(self.directory)
        number = 1 + max(0, *self._numbers(), *spoken_of.numbers, self.built_in.number if self.built_in else 0)
        if number > _LAST:
            raise StoreError(
                "E431", f"{self.directory} holds calibration {_LAST}, the last number: start a new --state"
            )
        return number


def as_text(calibration: Calibration) -> str:
    """Return a calibration as YAML, in the form of the shipped ones: values as JSON, which is YAML and loses no digit."""
    return "".join(f"{name}: {json.dumps(value, ensure_ascii=False)}\n" for name, value in asdict(calibration).items())


def _parse_unchecked(text: str) -> Calibration:
    """`as_text` backwards, for what it has written alone. ValueError or TypeError for anything else."""
    lines = (line.partition(": ") for line in text.splitlines() if not line.startswith("#"))
    facts = {name: json.loads(value) for name, _, value in lines}
    facts = {name: tuple(value) if isinstance(value, list) else value for name, value in facts.items()}
    response = facts.pop("response", None)
    return Calibration(**facts, response=Response(**response) if response else None)


def _encode_checked(calibration: Calibration) -> bytes:
    """Return a calibration's file. StoreError for one that could not be read back as it is."""
    data = add_checksum(as_text(calibration))
    if _parse_checked(data, Path(calibration.name)) != calibration:
        raise StoreError("E432", f"{calibration.name} holds a number that no file can")
    return data


def _file_name(number: int) -> str:
    return f"{number:04d}.yaml"


def _store_error(error: OSError) -> StoreError:
    return StoreError("E431", f"calibration not stored: {error.strerror or error}")


def _parse_checked(data: bytes, path: Path) -> Calibration:
    """Return the calibration of a file's bytes. StoreError for anything but what was sealed."""
    try:
        verify_checksum(data)
        calibration, faults = read_calibration(parse(data, str(path)))
    except ValueError as error:
        raise StoreError("E432", f"{path} {error}") from None
    except ProfileError as error:
        calibration, faults = None, list(error.faults)
    if calibration is None:
        raise StoreError("E432", str(faults[0]))
    return calibration
