"""Profiles: YAML text + positions -> frozen typed objects; every fault at once, file:line:column, in the user's words.

strict_yaml: from text to plain values with positions, and pydantic's findings in plain sentences. kinds: one file per kind of
profile. rigs: the form of a rig file, the checks across its parts, and the rig that comes of it. find and load look them up by
name or path; schema stands apart, for editors. How to write a profile is told in profiles/README.md.

Nothing here imports scipy: `check` answers at once. And each name is loaded when it is first asked for: a diagnosis reads one
plant, and need not wait for all that a rig file may say.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from gateway.profiles.find import list_shipped, shipped_profiles_folder
    from gateway.profiles.kinds.any_file import Checked, check_file
    from gateway.profiles.kinds.file_kind import CALLED
    from gateway.profiles.kinds.plants import Origin, PlantProfile
    from gateway.profiles.load import load_calibration, load_device, load_plant, load_register_map
    from gateway.profiles.rigs.assembly import Report, check_report, load_rig, read_rig
    from gateway.profiles.rigs.rig import CellLine, OutputLine, Rig
    from gateway.profiles.rigs.rig_file import Network, ResidualWatch
    from gateway.profiles.strict_yaml.faults import ProfileError, ProfileFault

__all__ = [
    "CALLED",
    "CellLine",
    "Checked",
    "Network",
    "Origin",
    "OutputLine",
    "PlantProfile",
    "ProfileError",
    "ProfileFault",
    "Report",
    "ResidualWatch",
    "Rig",
    "check_file",
    "check_report",
    "list_shipped",
    "load_calibration",
    "load_device",
    "load_plant",
    "load_register_map",
    "load_rig",
    "read_rig",
    "shipped_profiles_folder",
]
_HOMES: Final = {
    "list_shipped": "find",
    "shipped_profiles_folder": "find",
    "Checked": "kinds.any_file",
    "check_file": "kinds.any_file",
    "CALLED": "kinds.file_kind",
    "Origin": "kinds.plants",
    "PlantProfile": "kinds.plants",
    "load_calibration": "load",
    "load_device": "load",
    "load_plant": "load",
    "load_register_map": "load",
    "Report": "rigs.assembly",
    "check_report": "rigs.assembly",
    "load_rig": "rigs.assembly",
    "read_rig": "rigs.assembly",
    "CellLine": "rigs.rig",
    "OutputLine": "rigs.rig",
    "Rig": "rigs.rig",
    "Network": "rigs.rig_file",
    "ResidualWatch": "rigs.rig_file",
    "ProfileError": "strict_yaml.faults",
    "ProfileFault": "strict_yaml.faults",
}


def __getattr__(name: str) -> Any:
    """Load a name from its module."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = found
    return found
