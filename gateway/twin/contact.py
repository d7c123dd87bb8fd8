"""The contact beyond the slide, step by step: backlash and creep, which remember, then the formulas of effects/contact.py."""

from gateway.twin.effects.contact import SLOW, SPINDLE
from gateway.twin.effects.term import active_formulas
from gateway.twin.play_and_lags import RampShares, apply_play, follow_ramp, ramp_shares
from gateway.twin.sections import Contact
from gateway.twin.surroundings import TwinConditions


class ContactState:
    """`step` takes the slide's force and returns the contact force, N. is_on: is there anything to do at all?"""

    def __init__(self, contact: Contact, step_s: float, conditions: TwinConditions) -> None:
        self._contact, self._conditions, self._step_s = contact, conditions, step_s
        self._creep = self._lag_of(contact)
        self._play_n = self._late_n = self._passed_n = 0.0
        self.force_n = 0.0
        self.is_on = False
        self.select_active_effects(0.0)

    def _lag_of(self, contact: Contact) -> RampShares | None:
        return ramp_shares(contact.creep_s, self._step_s) if contact.creep_share != 0.0 else None

    def change_contact(self, contact: Contact, force_n: float) -> None:
        """Go on as another contact under the slide's force_n: a play that is new is closed, and nothing has crept yet."""
        if self._contact.backlash_n == 0.0:
            self._play_n = force_n
        if self._creep is None:
            self._late_n, self._passed_n = 0.0, force_n
        self._contact, self._creep = contact, self._lag_of(contact)
        self.select_active_effects(force_n)

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
