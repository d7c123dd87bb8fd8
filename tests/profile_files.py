"""Device and plan files by themselves; the gateway reads them as parts of a rig or of a run."""

from pathlib import Path

from gateway.devices import DeviceProfile
from gateway.profiles import ProfileError
from gateway.profiles.kinds.devices import read_device
from gateway.profiles.kinds.plans import AnyPlan, read_plan
from gateway.profiles.load import open_profile, read_named, refer_to
from gateway.profiles.strict_yaml.faults import Findings


def load_device(name: str | Path) -> DeviceProfile:
    """Return a device profile by shipped name or path; ProfileError with every fault."""
    findings = Findings()
    device = read_named("device", refer_to(name), read_device, findings)
    if device is None or findings.faults:
        raise ProfileError(findings.faults)
    return device


def load_plan(path: str | Path) -> AnyPlan:
    """Return the plan of a file; ProfileError with every fault."""
    findings = Findings()
    opened = open_profile("plan", refer_to(path), findings)
    if opened is None:
        raise ProfileError(findings.faults)
    return read_plan(opened[0])
