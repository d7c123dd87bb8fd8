"""The shipped rigs, read once, and the little that tests of the service change in them."""

from dataclasses import replace
from functools import cache

from gateway.profiles import Rig, load_rig


@cache
def demo() -> Rig:
    return load_rig("demo")


def with_supervision(rig: Rig, **bounds: object) -> Rig:
    """The same rig with other time bounds."""
    supervision = replace(rig.control.supervision, **bounds)  # type: ignore[arg-type]
    return replace(rig, control=replace(rig.control, supervision=supervision))


def strict() -> Rig:
    """The demo rig with the default bounds of supervision instead of those for a busy laptop."""
    return with_supervision(demo(), sample_timeout_s=0.05, output_timeout_s=0.1)


def without_trim(rig: Rig) -> Rig:
    return replace(rig, control=replace(rig.control, trim=replace(rig.control.trim, gain_v_per_n_s=0.0)))
