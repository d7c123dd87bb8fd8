"""The force controller: command, sample and line status in, one voltage with its reasons out. Pure; time is an argument.

`Controller.step` is a force loop (ramp, pre-contact force, contact ramp, inverse BSFM, bounded trim, limits) under a
supervision that shares nothing with it but the readings, over a state table. What a rig file may set is in `settings`.

force_loop/     from the accepted force to the voltage: feedforward, lead compensation, trim, limits
supervision/    what is watched while the output is enabled: the first cause of a fault, contact, band, lease
runs/           calibration ladders and experiments that the controller conducts by itself
compensation/   known defects of a rig, taken back

Glossary (the words of the ladder and of the branches: gateway.bsfm)
demand          a command with the rig's defaults in place of its zeros
target          the force to go for; applied force: the ramped target of this instant; measured force: the load cell's
feedforward     the voltage that the inverse model gives for the applied force; trim: what the load cell adds to it
contact force   what presses on the workpiece: cell force, and the payload's weight
given force     the part of it that the slide need not give: weight and forces from outside
rest            the safe voltage on the output; rest force: what the cell then measures
run             a calibration ladder or an experiment
"""

from gateway.control.compensation.cell_map import CellMap
from gateway.control.compensation.command_map import CommandMap, apply_command_map
from gateway.control.compensation.compensation import NO_COMPENSATION, Compensation, OutsideForce, TimingCompensation
from gateway.control.controller import Controller
from gateway.control.decision import safe_output
from gateway.control.inputs import CalibrationInUse, LineStatus, Output
from gateway.control.settings import ControlSettings, Defaults, LeadSettings, LeaseAction, Limits, Supervision, Trim

__all__ = [
    "NO_COMPENSATION",
    "CalibrationInUse",
    "CellMap",
    "CommandMap",
    "Compensation",
    "ControlSettings",
    "Controller",
    "Defaults",
    "LeadSettings",
    "LeaseAction",
    "Limits",
    "LineStatus",
    "Output",
    "OutsideForce",
    "Supervision",
    "TimingCompensation",
    "Trim",
    "apply_command_map",
    "safe_output",
]
