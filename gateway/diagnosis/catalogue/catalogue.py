"""The catalogue: 43 effects by name, in the order of the signal. Names are a contract."""

from typing import Final

from gateway.diagnosis.catalogue.contact import CONTACT
from gateway.diagnosis.catalogue.cylinder import CYLINDER
from gateway.diagnosis.catalogue.effect import Effect
from gateway.diagnosis.catalogue.regulator import REGULATOR
from gateway.diagnosis.catalogue.sensing import SENSING

EFFECTS: Final[tuple[Effect, ...]] = (*REGULATOR, *CYLINDER, *CONTACT, *SENSING)
BY_NAME: Final[dict[str, Effect]] = {effect.name: effect for effect in EFFECTS}


def effect_named(name: str) -> Effect:
    """KeyError for a name that the catalogue does not have."""
    return BY_NAME[name]
