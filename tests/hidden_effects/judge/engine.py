"""Asking the diagnosis: through Python as the gateway's own watch does, or through the command line as a person does.

Both answers become one plain `Answer`, so that the judge knows nothing of the engine but the contract's field names.
"""

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from generator.recording import Recording, write_csv


@dataclass(frozen=True, slots=True)
class Blamed:
    name: str
    group: tuple[str, ...]
    confidence: float


@dataclass(frozen=True, slots=True)
class Answer:
    verdict: str
    causes: tuple[Blamed, ...]
    leftover: tuple[str, ...]
    seconds: float


Engine = Callable[[Recording], Answer]


def missing() -> str:
    """Why the engine cannot be asked; empty when it can."""
    try:
        from gateway.diagnosis import Options, diagnose  # noqa: F401
    except ImportError as why:
        return f"gateway.diagnosis.diagnose is not there yet: {why}"
    return ""


def measurement_of(recording: Recording) -> Any:
    """The gateway's own type. Exact repeats count unless the readings are so coarse that they must repeat."""
    from gateway.diagnosis.measurement import Measurement

    force, columns = recording.force_n, dict(recording.covariates)
    position_mm, pressure_kpa = columns.pop("position_mm", None), columns.pop("pressure_kpa", None)
    coarse = np.unique(force).size < 0.2 * force.size
    same = np.zeros(force.size, dtype=bool) if coarse else np.diff(force, prepend=np.nan) == 0.0
    return Measurement(
        name=f"recording-{recording.wish.seed}",
        time_s=recording.time_s,
        force_n=force,
        usable=np.ones(force.size, dtype=bool),
        repeated=same,
        command_v=recording.command_v,
        pressure_pa=None if pressure_kpa is None else pressure_kpa * 1000.0,
        position_m=None if position_mm is None else position_mm / 1000.0,
        covariates=columns,
    )


def options_for(recording: Recording) -> Any:
    """`without` as the command line has it, as one name or several, whichever the engine's options hold."""
    from gateway.diagnosis import Options

    if not recording.without:
        return Options()
    default = {field.name: field for field in fields(Options)}["without"].default
    value: Any = recording.without[0] if default is None or isinstance(default, str) else recording.without
    return Options(without=frozenset(value) if isinstance(default, frozenset) else value)


def by_python(recording: Recording) -> Answer:
    from gateway.diagnosis import diagnose

    measurement, options = measurement_of(recording), options_for(recording)
    begun_s = time.perf_counter()
    found = diagnose([measurement], None, options)
    seconds = time.perf_counter() - begun_s
    causes = tuple(Blamed(cause.name, tuple(cause.group), float(cause.confidence)) for cause in found.causes)
    return Answer(str(found.verdict), causes, tuple(left.depends_on for left in found.leftover), seconds)


def by_command(recording: Recording) -> Answer:
    """`force-gateway diagnose FILE --json OUT`: reader, engine and JSON contract at once."""
    with tempfile.TemporaryDirectory() as folder:
        file, out = write_csv(recording, Path(folder)), Path(folder) / "answer.json"
        words = [sys.executable, "-m", "gateway", "diagnose", str(file), "--json", str(out)]
        words += [word for name in recording.without for word in ("--without", name)]
        begun_s = time.perf_counter()
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        seconds = time.perf_counter() - begun_s
        if done.returncode:
            raise RuntimeError(f"diagnose ended with {done.returncode}: {done.stderr[-500:]}")
        return of_json(json.loads(out.read_text(encoding="utf-8")), seconds)


def of_json(document: Mapping[str, Any], seconds: float) -> Answer:
    causes = tuple(Blamed(one["name"], tuple(one["group"]), float(one["confidence"])) for one in document["causes"])
    return Answer(document["verdict"], causes, tuple(one["depends_on"] for one in document["leftover"]), seconds)


def silent(_recording: Recording) -> Answer:
    """An engine that never says anything: what the harness itself costs, and what silence scores."""
    return Answer("nothing-found", (), (), 0.0)


ENGINES: dict[str, Engine] = {"python": by_python, "command": by_command, "silent": silent}
