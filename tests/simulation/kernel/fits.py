"""The fit of a recorded ladder without its process and its hour of arithmetic: it takes its time, and ends as one may end.

What it stores is the rig's own calibration with a mark of its own in it, so that the witness of uploads (I9) knows it again.
"""

import asyncio
import errno
import os
import struct
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any, ClassVar

from gateway.bsfm.model import Calibration
from gateway.calibrations.store import CalibrationStore
from gateway.numbered_documents.store import StoreError
from gateway.registers.upload.coefficients import CoefficientSet
from tests.simulation.kernel.edges import SimulatedDisk
from tests.simulation.kernel.virtual_time import VirtualLoop
from tests.simulation.masters.integrator import LESS_N, STEP_N

FIT_S = (0.2, 3.0)
FIRST_MARK = 60


class SimulatedFit:
    """Stands for `FitLauncher`. on_stored(mark): a set with this mark is stored from now on; ended: how many fits have."""

    outside: ClassVar[VirtualLoop]
    chance: ClassVar[Random] = Random(0)
    built_in: ClassVar[Calibration]
    on_stored: ClassVar[Callable[[int], None]] = staticmethod(lambda mark: None)
    ended: ClassVar[list[dict[str, Any]]] = []

    def __init__(
        self, recording: Path, rig_file: Path, state: Path, on_result: Callable[[dict[str, Any]], None]
    ) -> None:
        if self.chance.random() < 0.1:
            raise OSError(errno.EAGAIN, os.strerror(errno.EAGAIN))
        self._state, self._on_result, self._is_heard = state, on_result, True
        self._inside = asyncio.get_running_loop()
        self._is_whole = recording.is_file() and recording.stat().st_size > 0
        self.outside.call_later(self.chance.uniform(*FIT_S), self._end)

    def close(self) -> None:
        self._is_heard = False

    def _end(self) -> None:
        """What is stored is of use whoever listens."""
        if SimulatedDisk.is_gone:
            return
        result = self._result()
        self.ended.append(result)
        if self._is_heard:
            self._inside.call_soon(self._on_result, result)

    def _result(self) -> dict[str, Any]:
        draw = self.chance.random()
        if not self._is_whole:
            raise AssertionError("a fit is started, and its recording is not there")
        if draw < 0.2:
            return {"refused": "E421 the ladder has too few stairs"}
        if draw < 0.3:
            return {"refused": "A331 the fit process ended without a result; force-gateway fit RECORDING shows why"}
        mark = FIRST_MARK + len(self.ended)
        rejected = "0.90 N off, allowed 0.50 N" if draw < 0.45 else ""
        try:
            number = SimulatedDisk.do(lambda: self._store(mark, rejected))
        except (StoreError, OSError) as error:
            return {"refused": str(error)}
        self.on_stored(mark)
        report = {"report": f"{number:04d}.html", "document": f"{number:04d}.json"}
        return {"rejected": number, "refused": f"E435 {rejected}"} | report if rejected else {"stored": number} | report

    def _store(self, mark: int, rejected: str) -> int:
        return CalibrationStore(self._state, self.built_in).add(marked(self.built_in, mark, rejected))


def marked(own: Calibration, mark: int, rejected: str = "") -> Calibration:
    """Return a rig's own calibration with a mark, as `with_mark` makes its words."""
    limits = CoefficientSet.of_calibration(own)
    *others, top_n = own.rising_handles_n
    top_n = struct.unpack(">f", struct.pack(">f", top_n))[0] + mark * STEP_N
    return replace(
        own,
        rising_handles_n=(*others, top_n),
        force_limits_n=(limits.force_low_n, LESS_N if mark < 0 else limits.force_high_n),
        rejected=rejected,
        data_sha256=f"{abs(mark):064x}",
    )
