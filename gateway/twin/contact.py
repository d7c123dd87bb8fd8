"""The contact beyond the slide, step by step: backlash and creep, which remember, then the formulas of effects/contact.py."""

from gateway.twin.effects.contact import SLOW, SPINDLE
from gateway.twin.effects.term import active_formulas
from gateway.twin.play_and_lags import apply_play, follow_ramp, ramp_shares
from gateway.twin.sections import Contact
from gateway.twin.surroundings import TwinConditions


class ContactState:
    """`step` takes the slide's force and returns the contact force, N. is_on: is there anything to do at all?"""

    def __init__(self, contact: Contact, step_s: float, conditions: TwinConditions) -> None:
        self._contact, self._conditions = contact, conditions
        self._creep = ramp_shares(contact.creep_s, step_s) if contact.creep_share != 0.0 else None
        self._play_n = self._late_n = self._passed_n = 0.0
        self.force_n = 0.0
        self.is_on = False
        self.select_active_effects(0.0)

    def select_active_effects(self, force_n: float) -> None:
        """Choose the effects that act, from what is known of the surroundings now. force_n: of the slide."""
        if not self.is_on:
            self.force_n = force_n
        self._terms = active_formulas((*SLOW, SPINDLE), self._contact, self._conditions)
        self.is_on = bool(self._terms) or self._contact.backlash_n != 0.0 or self._creep is not None

    def step(self, force_n: float) -> float:
        """Return the contact force of one step."""
        contact, conditions = self._contact, self._conditions
        if contact.backlash_n != 0.0:
            self._play_n = force_n = apply_play(self._play_n, force_n, contact.backlash_n)
        if self._creep is not None:
            self._late_n = follow_ramp(self._late_n, self._creep, self._passed_n, force_n)
            self._passed_n = force_n
            force_n = force_n + contact.creep_share * self._late_n
        for term in self._terms:
            force_n = term(contact, force_n, conditions)
        self.force_n = force_n
        return force_n
