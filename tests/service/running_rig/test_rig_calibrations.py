"""The calibrations of a running rig: what its start says of the one in use, and what an upload is stored with."""

from dataclasses import replace
from pathlib import Path

from gateway.calibrations.store import CalibrationStore
from gateway.profiles import Rig
from gateway.registers import BankRules, RegisterBank
from gateway.registers.upload.coefficients import CoefficientSet
from gateway.service.running_rig.rig_calibrations import RigCalibrations
from tests.calibrations.coefficients import calibration, requests_of, staged
from tests.calibrations.upload_bench import COMMIT, PEER
from tests.service.rigs import demo


def real() -> Rig:
    """A rig of which only its name, its map and its calibration, made on another one, count here."""
    rig = replace(demo(), name="left-cell", simulated=False)
    assert rig.doubts_on(rig.calibration)
    return rig


def test_of_the_rigs_own_calibration_a_start_says_nothing_more(tmp_path: Path) -> None:
    """It is judged with its file, whose notes say it already."""
    assert RigCalibrations(real(), tmp_path).notes == ()


def test_of_one_that_was_chosen_it_says_which_and_what_is_doubtful(tmp_path: Path) -> None:
    store = CalibrationStore(tmp_path, real().calibration)
    store.use(store.add(calibration(8, rig="right-cell")), None)
    calibrations = RigCalibrations(real(), tmp_path)
    assert calibrations.rig.calibration.number == 2, "and presses by it"
    chosen, doubts = calibrations.notes
    assert chosen.startswith("calibration 2 of ")
    assert "right-cell" in doubts


def test_of_one_with_which_this_rig_takes_no_force_it_says_so(tmp_path: Path) -> None:
    store = CalibrationStore(tmp_path, demo().calibration)
    store.use(store.add(replace(demo().calibration, force_limits_n=(62.0, 65.0))), None)
    assert "62 N and more, demo for 60 N at most" in RigCalibrations(demo(), tmp_path).notes[-1]


def test_an_upload_is_stored_as_of_this_rig(tmp_path: Path) -> None:
    """So that nobody calls its forces a guess the next time."""
    calibrations = RigCalibrations(real(), tmp_path)
    bank = RegisterBank(real().register_map, BankRules(rig_name="left-cell", force_max_n=60.0), now=lambda: 0.0)
    upload = calibrations.serve(bank, lambda active: None, lambda cause, sentence: None)
    upload.run_in_background = lambda work, done: done(work())
    for address, data in requests_of(staged(CoefficientSet.of_calibration(calibration(9)))):
        bank.write_registers(address, data, PEER)
    bank.write_registers(real().register_map.find("commit").address, COMMIT.to_bytes(2), PEER)
    upload.close()
    stored = CalibrationStore(tmp_path, real().calibration).load(2)
    assert stored.rig == "left-cell"
    assert RigCalibrations(real(), tmp_path).notes[1:] == ()
