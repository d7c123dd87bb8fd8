"""The force controller: command, sample and line state in, one voltage with its reasons out. Pure; time is an argument.

`Controller.step` is a force law (ramp, pre-contact force, contact ramp, inverse BSFM, bounded trim, limits) under a
supervision that shares nothing with it but the readings, over a state table. What a rig file may set is in `settings`.
"""

from gateway.control.compensation.command_map import CommandMap, apply_command_map
from gateway.control.compensation.compensation import NO_COMPENSATION, Compensation, OutsideForce, TimingCompensation
from gateway.control.compensation.load_cell import CellMap
from gateway.control.controller import Controller
from gateway.control.decision import safe_output
from gateway.control.inputs import NO_COMMAND, LineStatus, Output
from gateway.control.settings import ControlSettings, Defaults, LeadSettings, LeaseAction, Limits, Supervision, Trim

__all__ = [
    "NO_COMMAND",
    "NO_COMPENSATION",
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
