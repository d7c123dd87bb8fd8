"""The contact beyond the slide, step by step: backlash and creep, which remember, then the formulas of effects/contact.py."""

import numpy as np

from gateway.twin.effects.contact import SLOW, SPINDLE
from gateway.twin.effects.term import active_formulas
from gateway.twin.elementwise import Real
from gateway.twin.regulator import apply_play, lag_factor
from gateway.twin.sections import Contact
from gateway.twin.surroundings import TwinConditions


class ContactState:
    """`step` takes the slide's force and returns the contact force, N. is_on: is there anything to do at all?"""

    def __init__(self, contact: Contact, step_s: float, conditions: TwinConditions, zero: Real) -> None:
        self._contact, self._conditions = contact, conditions
        self._backlash = bool(np.any(contact.backlash_n))
        self._creep = lag_factor(contact.creep_s, step_s) if np.any(contact.creep_share) else None
        self._play_n: Real = zero
        self._late_n: Real = zero
        self.force_n: Real = zero
        self.is_on = False
        self.select_active_effects(zero)

    def select_active_effects(self, force_n: Real) -> None:
        """Choose the effects that act, from what is known of the surroundings now. force_n: of the slide."""
        if not self.is_on:
            self.force_n = force_n
        self._terms = active_formulas((*SLOW, SPINDLE), self._contact, self._conditions)
        self.is_on = bool(self._terms) or self._backlash or self._creep is not None

    def step(self, force_n: Real) -> Real:
        """Return the contact force of one step."""
        contact, conditions = self._contact, self._conditions
        if self._backlash:
            self._play_n = force_n = apply_play(self._play_n, force_n, contact.backlash_n)
        if self._creep is not None:
            self._late_n = self._late_n + self._creep * (force_n - self._late_n)
            force_n = force_n + contact.creep_share * self._late_n
        for term in self._terms:
            force_n = term(contact, force_n, conditions)
        self.force_n = force_n
        return force_n
