"""The branches that the page draws behind the measured points: over the volts that go out."""

import asyncio
from dataclasses import replace
from pathlib import Path

import pytest

from gateway.control import CommandMap
from gateway.plants.store import PlantStore
from gateway.processes.durable_file import lock_directory
from gateway.web.model_curves import model_curves
from tests.plants.test_plant_store import numbered
from tests.service.rigs import demo
from tests.web.asgi import call, page

BOW = 0.06  # of the stored plant


def test_the_branches_are_bent_as_the_plant_in_use_bends_the_command(tmp_path: Path) -> None:
    """Of a calibration that another rig has measured: one's own has measured the bend."""
    rig = replace(demo(), name="another")
    straight = model_curves(rig, tmp_path)
    store = PlantStore(tmp_path)
    store.use(store.add(numbered()))
    bent = model_curves(rig, tmp_path)
    to_sent_v = CommandMap(bow=BOW, s=0.0).sent_v
    assert bent["voltage_v"][-1] == pytest.approx(to_sent_v(straight["voltage_v"][-1]))
    model = rig.calibration.model()
    for place in (0, 17, 40, 80):
        straight_v, _ = model.voltage_v(bent["rising_n"][place], 1.0)
        assert to_sent_v(straight_v) == pytest.approx(bent["voltage_v"][place], abs=1e-6)
    own = replace(rig, calibration=replace(rig.calibration, rig=rig.name))
    assert model_curves(own, tmp_path) == straight


def test_a_store_that_somebody_changes_keeps_nobody_else_waiting(tmp_path: Path) -> None:
    """Each page that asked for the branches meanwhile held up all others for two seconds, and a Stop with them."""
    (tmp_path / "calibrations").mkdir()

    async def ask() -> None:
        app = page(tmp_path)
        with lock_directory(tmp_path / "calibrations"):
            curves = asyncio.create_task(call(app, "GET", "/api/v1/model"))
            await asyncio.sleep(0)  # it begins first
            assert (await call(app, "GET", "/healthz")).status == 200
            assert not curves.done()
        assert (await curves).json["rising_n"]

    asyncio.run(ask())
