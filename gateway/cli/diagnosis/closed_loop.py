"""`diagnose --closed-loop`: the gain in commanded force, asked of the twin and told."""

from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

from gateway.cli.diagnosis.inputs import Sources
from gateway.diagnosis.result import Diagnosis
from gateway.service.closed_loop import study
from gateway.service.closed_loop.study import ClosedLoopGain
from gateway.twin.plant import with_value


def measure_gain(diagnosis: Diagnosis, sources: Sources) -> ClosedLoopGain | str:
    """Return the gain, or a sentence that says why it could not be measured.

    The cell makes the noise of the plant at the start: the diagnosis has taken it away, and control takes a cell without
    any for a stuck one.
    """
    noise_n = sources.plant.plant.cell.noise_n
    base, extended = (with_value(plant, "cell", "noise_n", noise_n) for plant in (diagnosis.base, diagnosis.plant))
    try:
        return study.closed_loop_gain(base, extended, sources.known_rig)
    except ValueError as error:
        return f"not measured: {error}"


def document(gain: ClosedLoopGain | str) -> dict[str, Any]:
    """Return the gain as JSON fields that go beside the contract's."""
    return {"error": gain} if isinstance(gain, str) else asdict(gain)


def sentences(gain: ClosedLoopGain | str) -> Iterator[str]:
    """Yield the gain, or why there is none, as sentences."""
    yield from [gain] if isinstance(gain, str) else study.format_gain(gain)
