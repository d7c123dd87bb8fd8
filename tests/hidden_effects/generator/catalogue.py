"""The 45 names of the contract, what the page says cannot be told apart, and what physics adds to that."""

from generator import effects_contact, effects_cylinder, effects_regulator, effects_sensing, outside
from generator.plant import Effect

INSIDE = effects_regulator.EFFECTS + effects_cylinder.EFFECTS + effects_contact.EFFECTS + effects_sensing.EFFECTS
EFFECTS: dict[str, Effect] = {effect.name: effect for effect in (*INSIDE, *outside.EFFECTS)}
NAMES = tuple(effect.name for effect in INSIDE)
OUTSIDE = tuple(effect.name for effect in outside.EFFECTS)

# Indistinguishable unless an extra channel or excitation exists, and then reported as a group.
PAGE_GROUPS = (
    ("regulator-hysteresis", "coulomb-friction"),
    ("transport-delay", "clock-offset", "extra-lag", "viscous-friction", "pressure-lag"),
    ("linear-drift", "pad-wear", "warm-up", "creep", "thermal-zero-drift"),
    ("sensor-quadratic", "sensor-cubic", "supply-saturation", "contact-nonlinearity"),
    ("coulomb-friction", "viscous-friction", "presliding"),
    ("end-stop", "supply-saturation"),
    ("stribeck-friction", "presliding"),
    ("leak", "warm-up"),
)
# The same curve or the same loop from other causes, which the page does not list: a group that holds the truth is no lie.
PHYSICAL_GROUPS = (
    ("sensor-quadratic", "sensor-cubic", "supply-saturation", "contact-nonlinearity", "end-stop", "leak",
     "command-nonlinearity", "backlash", "sign-loss"),
    ("transport-delay", "clock-offset", "extra-lag", "viscous-friction", "asymmetric-friction", "slew-limit",
     "valve-crosstalk", "pressure-lag"),
    ("regulator-hysteresis", "coulomb-friction", "load-dependent-friction", "side-load", "presliding", "stribeck-friction",
     "dwell-stiction", "dead-band"),
    ("feed-drag", "position-dependence"),
    ("position-dependent-friction", "position-dependence", "side-load", "load-dependent-friction"),
)  # fmt: skip


def page_group(name: str) -> frozenset[str]:
    """Every name that may stand beside this one, itself included, by what a recording can tell apart."""
    return frozenset({name}.union(*(group for group in PAGE_GROUPS if name in group)))


def physical_group(name: str) -> frozenset[str]:
    """The page's group and what gives the same picture by physics."""
    return page_group(name).union(*(group for group in PHYSICAL_GROUPS if name in group))


def effect(name: str) -> Effect:
    """ValueError on a name that is neither in the catalogue nor among the causes outside it."""
    if name not in EFFECTS:
        raise ValueError(f"no effect {name!r}; there are {', '.join(EFFECTS)}")
    return EFFECTS[name]
