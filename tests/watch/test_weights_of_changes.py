"""What each change of the plant weighs: what it does to the force by itself, and no more than what it saves."""

from dataclasses import replace
from math import hypot
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gateway.diagnosis.result import Cause, Estimate, Gain
from gateway.twin.plant import Friction, Plant, Regulator
from gateway.watch import window_verdict
from gateway.watch.window_verdict import PlantChange, weigh_changes

LEFT_N = 0.2
REFERENCE = Plant(friction=Friction(coulomb_n=1.0), regulator=Regulator(lag_s=0.1, delay_s=0.01))
FOUND = replace(
    REFERENCE, friction=Friction(coulomb_n=1.5), regulator=Regulator(lag_s=0.4, delay_s=0.06)
)  # 0.5 N, 0.3 s, 0.05 s
WAVE = np.array([1.0, -1.0, 1.0, -1.0])


def residuals(_measurement: object, plants: list[Plant]) -> np.ndarray:
    """Friction swings the force by itself, the lag and the dead time, too; friction shifts it besides."""
    return np.array(
        [
            (7.0 * each.friction.coulomb_n + WAVE * (each.friction.coulomb_n + 0.2 * each.regulator.lag_s))
            + WAVE * 10.0 * each.regulator.delay_s
            for each in plants
        ]
    )


def delay(saved_n: float, *group: str, name: str = "transport-delay", worse_n: float = 0.0) -> Cause:
    """A cause that saves so much in rows that its fit has not seen."""
    gain = Gain(hypot(LEFT_N, saved_n), LEFT_N + worse_n, (0.0, 1.0), 0.5)
    value: Any = SimpleNamespace(section="regulator", value=0.06, unit="s")
    parameters: dict[str, Estimate] = {"delay_s": value}
    return Cause(name, group or (name,), 0.9, parameters, gain)


def weighed(
    monkeypatch: pytest.MonkeyPatch, *causes: Cause, saved_n: float = 5.0, found: Plant = FOUND
) -> dict[str, PlantChange]:
    """saved_n: what the diagnosis' plant saves of the whole window."""
    rms_n = {REFERENCE: hypot(LEFT_N, saved_n), found: LEFT_N}
    monkeypatch.setattr(window_verdict, "residuals", residuals)
    monkeypatch.setattr(window_verdict, "rms_of", lambda _measurement, plant: rms_n[plant])
    window: Any = SimpleNamespace(measurement=None)
    diagnosis: Any = SimpleNamespace(plant=found, causes=causes)
    return {change.name: change for change in weigh_changes(window, diagnosis, REFERENCE)}


def test_a_change_weighs_what_undoing_it_alone_does_to_the_force_around_its_mean(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A shift of the mean is a tare and no change; what the search fits anyway counts like what it finds."""
    changes = weighed(monkeypatch, delay(3.0))
    weights_n = {name: change.force_n for name, change in changes.items()}
    assert weights_n == pytest.approx({"coulomb-friction": 0.5, "extra-lag": 0.06, "gain": 0.0, "transport-delay": 0.5})


def test_no_change_weighs_more_than_what_all_of_them_save(monkeypatch: pytest.MonkeyPatch) -> None:
    changes = weighed(monkeypatch, delay(3.0), saved_n=0.3)
    assert [changes[name].force_n for name in ("coulomb-friction", "extra-lag", "transport-delay")] == pytest.approx(
        [0.3, 0.06, 0.3]
    )


def test_a_cause_weighs_no_more_than_it_saves_in_rows_that_its_fit_did_not_see(monkeypatch: pytest.MonkeyPatch) -> None:
    changes = weighed(monkeypatch, delay(0.1))
    assert changes["transport-delay"].force_n == pytest.approx(0.1)
    assert changes["coulomb-friction"].force_n == pytest.approx(0.5), "that limit is the cause's own"
    assert weighed(monkeypatch, delay(0.1, worse_n=1.0))["transport-delay"].force_n == 0.0


def test_where_the_reference_is_no_worse_nothing_has_changed(monkeypatch: pytest.MonkeyPatch) -> None:
    rms_n = {REFERENCE: LEFT_N, FOUND: 2.0 * LEFT_N}
    monkeypatch.setattr(window_verdict, "residuals", residuals)
    monkeypatch.setattr(window_verdict, "rms_of", lambda _measurement, plant: rms_n[plant])
    window: Any = SimpleNamespace(measurement=None)
    diagnosis: Any = SimpleNamespace(plant=FOUND, causes=(delay(3.0),))
    assert [change.force_n for change in weigh_changes(window, diagnosis, REFERENCE)] == [0.0] * 4


def test_what_is_weighed_keeps_its_parameters_and_those_it_may_be_taken_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """Under the name that can be published: one clock stamps readings and commands."""
    changes = weighed(monkeypatch, delay(3.0, "clock-offset", "transport-delay", name="clock-offset"))
    found = changes["transport-delay"]
    assert (found.parameters, found.others) == ((("regulator", "delay_s", "s"),), ("clock-offset", "transport-delay"))
    assert changes["extra-lag"].parameters == (("regulator", "lag_s", "s"),)
