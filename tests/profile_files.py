"""Device and plan files by themselves (load_device is the product's); the gateway reads them as parts of a rig or of a run."""

from pathlib import Path

from gateway.profiles import ProfileError, load_device
from gateway.profiles.kinds.plans import AnyPlan, read_plan
from gateway.profiles.load import open_profile, refer_to
from gateway.profiles.strict_yaml.faults import Findings

__all__ = ["load_device", "load_plan"]


def load_plan(path: str | Path) -> AnyPlan:
    """Return the plan of a file; ProfileError with every fault."""
    findings = Findings()
    opened = open_profile("plan", refer_to(path), findings)
    if opened is None:
        raise ProfileError(findings.faults)
    return read_plan(opened[0])
