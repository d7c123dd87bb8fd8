"""The calibrations of one rig: numbered, immutable, and which of them is in use (gateway.numbered_documents.store).

STATE/calibrations holds them, each in the form of the shipped ones with its CRC-32 in the first line.
"""

import contextlib
import json
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path
from typing import Final

from gateway.bsfm.model import Calibration, Response
from gateway.numbered_documents.store import NumberedStore, StoreError, file_name
from gateway.processes.durable_file import add_checksum, read_regular, verify_checksum
from gateway.processes.state_directory import CALIBRATIONS
from gateway.profiles import ProfileError, Rig
from gateway.profiles.kinds.calibrations import read_calibration
from gateway.profiles.strict_yaml.text import parse

UNKNOWN_N: Final = -1.0
"""rms_n and max_n of a calibration whose data nobody has seen: an upload carries coefficients only."""
_IS_UPLOAD: Final = f"\nrms_n: {UNKNOWN_N}\n"


class CalibrationStore(NumberedStore[Calibration]):
    """built_in: the calibration that the rig's file names."""

    noun = "calibration"

    def __init__(self, state: Path, built_in: Calibration | None = None) -> None:
        super().__init__(state / CALIBRATIONS, built_in)

    def number_of(self, document: Calibration) -> int:
        """Return its number."""
        return document.number

    def encode(self, document: Calibration, number: int) -> bytes:
        """Return its file under this number. StoreError for one that could not be read back as it is."""
        calibration = replace(document, number=number)
        data = add_checksum(as_text(calibration))
        if self.decode(data, Path(calibration.name)) != calibration:
            raise StoreError("E432", f"{calibration.name} holds a number that no file can")
        return data

    def decode(self, data: bytes, path: Path) -> Calibration:
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

    def iterate_unchecked(self, set_sha256: str) -> Iterator[tuple[int, Calibration]]:
        """Yield every calibration that may hold the set with this hash, the last one first, without checking any: a search
        through thousands of them must not keep the loop waiting, and so of uploads, which carry their set's hash, others are
        not even parsed. So `load` what is found; files that cannot be read are left out."""
        for number in reversed(self.numbers()):
            with contextlib.suppress(OSError, ValueError, TypeError):
                text = read_regular(self.directory / file_name(number)).decode()
                if _IS_UPLOAD not in text or set_sha256 in text:
                    yield number, _parse_unchecked(text)

    def find_data(self, data_sha256: str) -> int | None:
        """Return the number of the calibration that was made of these very data, None where there is none."""
        return next((e.number for e in self.list() if e.document and e.document.data_sha256 == data_sha256), None)


def calibration_in_use(rig: Rig, state: Path) -> Calibration:
    """Return the calibration in use in a state directory, else the rig's built-in one."""
    return CalibrationStore(state, rig.calibration).find_selected().document or rig.calibration


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
