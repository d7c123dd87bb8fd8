"""What has changed on a machine that is not the twin: its own nature raises no name, an effect that is switched on does.

The fast part looks at one machine for 20 s; `--long` at all fourteen effects, 40 s each, at 1.5 times the noise.
Measured there: thirteen alone, by their name or a group with it; dwell-stiction is seen and has no name.
"""

import numpy as np
import pytest

from gateway.diagnosis import Diagnosis, Options, Verdict, find_changes
from gateway.diagnosis.against.compare_recordings import compare_with_machine
from gateway.diagnosis.against.machine import MachineModel, describe_machine
from gateway.diagnosis.model_fit.base_fit import DEFAULT_PLANT
from tests.diagnosis.against.foreign_rig import EFFECTS, Day, Wish, readings, record

COLUMNS = {
    "supply-droop": ("supply_kpa",),
    "position-friction": ("position_mm",),
    "thermal-zero-drift": ("temperature_c",),
}
NAMES = {"position-friction": {"side-load", "position-dependent-friction"}}
"""Names that an effect may have; its own where nothing is said."""
LEAST_NAMED = 12  # of the fourteen


def machine_of(columns: tuple[str, ...], duration_s: float) -> MachineModel:
    old, _ = record(Wish(seed=103, columns=columns, duration_s=duration_s))
    return describe_machine([old], DEFAULT_PLANT, Options())


def changes(machine: MachineModel, wish: Wish) -> Diagnosis:
    new, _ = record(wish)
    return compare_with_machine([new], machine, DEFAULT_PLANT, Options())


def is_named_alone(found: Diagnosis, effect: str) -> bool:
    right = NAMES.get(effect, {effect})
    return len(found.causes) == 1 and bool(right & {found.causes[0].name, *found.causes[0].group})


@pytest.fixture(scope="module")
def short_machine() -> MachineModel:
    return machine_of((), 20.0)


def test_a_machines_own_nature_has_no_name(short_machine):
    found = changes(short_machine, Wish(seed=3, duration_s=20.0))
    assert found.causes == ()
    assert found.machine is not None and found.machine.common_error_n > 0.05


def test_a_change_is_named_alone_beside_what_was_there_before(short_machine):
    wish = Wish(seed=3, effect="transport-delay", size=2.0, duration_s=20.0)
    found = changes(short_machine, wish)
    assert is_named_alone(found, "transport-delay")
    assert found.verdict in {Verdict.PARTIAL, Verdict.CONFIRMED}
    (cause,) = found.causes
    for name, estimate in cause.parameters.items():
        assert estimate.value != getattr(getattr(found.base, estimate.section), name)


def test_without_recordings_there_is_nothing_to_compare():
    with pytest.raises(ValueError, match="before and after"):
        find_changes([], [])


@pytest.mark.parametrize("effect", EFFECTS)
def test_nothing_of_an_effect_is_no_effect(effect):
    day, quiet = np.full(400, 2.0), np.zeros(400)
    still = Day(day, quiet, quiet + 600.0, quiet + 22.0)
    assert np.array_equal(readings(still, effect, 0.0, quiet), readings(still, "", 0.0, quiet))


@pytest.mark.long
def test_most_effects_are_named_without_a_companion(capsys):
    machines: dict[tuple[str, ...], MachineModel] = {}
    lines, right = [], 0
    for effect in ("", *EFFECTS):
        columns = COLUMNS.get(effect, ())
        machine = machines.setdefault(columns, None) or machine_of(columns, 40.0)  # type: ignore[arg-type]
        machines[columns] = machine
        found = changes(machine, Wish(seed=3, effect=effect, size=1.5, duration_s=40.0, columns=columns))
        right += bool(effect) and is_named_alone(found, effect)
        lines.append(f"{effect or 'quiet':22s} {[[each.name, *each.group[1:]] for each in found.causes]}")
        assert effect or not found.causes
    with capsys.disabled():
        print("\n" + "\n".join(lines))
    assert right >= LEAST_NAMED, "\n".join(lines)
