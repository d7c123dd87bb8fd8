"""All entries by name, in the order of their numbers, which is that of the signal. Names and numbers are contracts."""

from typing import Final

from gateway.catalogue.contact import CONTACT
from gateway.catalogue.cylinder import CYLINDER
from gateway.catalogue.effect import Effect
from gateway.catalogue.regulator import REGULATOR
from gateway.catalogue.sensing import SENSING
from gateway.catalogue.tool_motion import TOOL_MOTION

EFFECTS: Final[tuple[Effect, ...]] = tuple(
    sorted((*REGULATOR, *CYLINDER, *CONTACT, *TOOL_MOTION, *SENSING), key=lambda effect: effect.number)
)
BY_NAME: Final[dict[str, Effect]] = {effect.name: effect for effect in EFFECTS}
