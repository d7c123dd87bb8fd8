"""All entries by name, in the order of the signal. Names and numbers are contracts."""

from typing import Final

from gateway.catalogue.contact import CONTACT
from gateway.catalogue.cylinder import CYLINDER
from gateway.catalogue.effect import Effect
from gateway.catalogue.regulator import REGULATOR
from gateway.catalogue.sensing import SENSING

EFFECTS: Final[tuple[Effect, ...]] = (*REGULATOR, *CYLINDER, *CONTACT, *SENSING)
BY_NAME: Final[dict[str, Effect]] = {effect.name: effect for effect in EFFECTS}
