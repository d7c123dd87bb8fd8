"""The causes that the residual watch can name in the register residual_cause, by the numbers of the catalogue of effects."""

from enum import IntEnum

from gateway.catalogue.all_effects import EFFECTS


class ResidualCause(IntEnum):
    """What makes the measurements differ from the model. UNKNOWN: they do, and no cause of the catalogue explains it.

    Between NONE and UNKNOWN stands each effect under its name in capitals (TRANSPORT_DELAY).
    """

    _ignore_ = "members entry"
    NONE = 0
    members = vars()
    for entry in EFFECTS:
        members[entry.name.upper().replace("-", "_")] = entry.number
    UNKNOWN = 99

    @property
    def effect(self) -> str:
        """The name in the catalogue: `transport-delay`."""
        return self.name.lower().replace("_", "-")

    @classmethod
    def of_effect(cls, name: str) -> "ResidualCause":
        """Return the number of an effect; UNKNOWN for a name that the catalogue does not have."""
        return cls.__members__.get(name.upper().replace("-", "_"), cls.UNKNOWN)
