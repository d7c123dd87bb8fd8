"""The slide of the running twin: the step of slide.py with what changes while it moves - surface, side load, disturbance."""

from typing import Final

from gateway.defaults import UNLIMITED
from gateway.twin.friction import stribeck_limit_n, two_sided_limit
from gateway.twin.plant import Plant
from gateway.twin.play_and_lags import RampShares, follow_ramp, ramp_shares
from gateway.twin.slide import SlideState, advance_slide, slide_of, with_gap, without_motion

_ROUNDING: Final = 1.0e-9  # of a strain: the same friction again is left alone


class MovingSlide:
    """`step` takes the pressure of a step and returns the contact force, N."""

    def __init__(self, plant: Plant, step_s: float) -> None:
        self._step_s = step_s
        self._slide = slide_of(plant)
        self._surface_gap_m = self._contact_gap_m = self._slide.gap_m
        self._touching = True
        self._side_n = self._side_share = self._more_out_n = self._disturbance_n = 0.0
        self._chamber = self._lag_of(plant)
        self._gauge_pa = self._chamber_pa = 0.0
        self.state = SlideState()
        self._stepped: tuple[object, ...] = ()  # slide, state and loads that the last step was computed from

    def _lag_of(self, plant: Plant) -> RampShares | None:
        lag_s = plant.cylinder.chamber_lag_s
        return ramp_shares(lag_s, self._step_s) if lag_s != 0.0 else None

    def change_plant(self, plant: Plant) -> None:
        """Go on as another plant's slide, from where it stands; `hold_friction` comes when its side load is known."""
        height_m, self._slide = self._contact_gap_m - self._surface_gap_m, slide_of(plant)
        if self._chamber is None:
            self._chamber_pa = self._gauge_pa
        self._chamber = self._lag_of(plant)
        if self._slide.stiction_n == 0.0:
            self.state = self.state._replace(stiction_n=0.0)
        self._contact_gap_m = self._slide.gap_m
        self.set_surface(height_m)

    def hold_friction(self) -> None:
        """Let friction that has become another one hold what it held, as far as it can: one that grows does not push."""
        slide, state = self._slide, self.state
        thrust_n = slide.area_m2 * (self._gauge_pa if self._chamber is None else self._chamber_pa)
        limit_n = slide.coulomb_n + slide.load_dependent_n_per_n * thrust_n + state.stiction_n
        limit_n += self._side_n + self._side_share * thrust_n
        if slide.stribeck_n != 0.0:
            limit_n += stribeck_limit_n(slide.stribeck_n, state.travel_m / (slide.stribeck_m_per_s * self._step_s))
        limit_n, centre_n = two_sided_limit(limit_n, slide.asymmetry_n + self._more_out_n)
        carried_n = limit_n * sum(state.strains) / len(state.strains)
        most = max(abs(strain) for strain in state.strains)
        if carried_n == 0.0:
            return
        one, two, three = state.strains
        scale = min(max((state.friction_n - centre_n) / carried_n, 0.0), 1.0 / most)
        if abs(scale - 1.0) > _ROUNDING:
            self.state = state._replace(strains=(one * scale, two * scale, three * scale))

    @property
    def force_n(self) -> float:
        """Return the contact force, N."""
        return self.state.force_n

    @property
    def speed_m_per_s(self) -> float:
        """Return the mean speed of the last step."""
        return self.state.travel_m / self._step_s

    def set_contact(self, on: bool) -> None:
        """Take the workpiece away, or bring it back to where the gap says: the slide is pushed back to touch it."""
        if on and not self._touching:
            position_m = min(self.state.position_m, self._surface_gap_m)
            self.state = self.state._replace(position_m=position_m, travel_m=0.0)
        self._touching = on
        self._place()

    def set_surface(self, height_m: float) -> None:
        """Set by how much the workpiece's surface stands nearer to the tool than the gap says; 0 is null."""
        self._surface_gap_m = self._contact_gap_m - height_m
        self._place()

    def set_side_load(self, load_n: float, share: float, more_out_n: float) -> None:
        """Set by how much what is around the slide raises its friction, N, and this share of the thrust; 0 is null.

        more_out_n: by how much more moving out, and less moving in.
        """
        self._side_n, self._side_share, self._more_out_n = load_n, share, more_out_n

    def set_disturbance(self, force_n: float) -> None:
        """Set an outside force on the slide, positive towards the workpiece; 0 is null."""
        self._disturbance_n = force_n

    def press_and_vent(self, pressure_pa: float) -> None:
        """Put the slide where a slow stroke with this pressure and its vent leave it: friction keeps a part of the force."""
        still = without_motion(self._slide)
        for thrust_n in (still.area_m2 * pressure_pa, 0.0):
            self.state = advance_slide(still, self.state, (thrust_n, 0.0, 0.0, 0.0), self._step_s, self._step_s)
        self.state = self.state._replace(travel_m=0.0)

    def step(self, pressure_pa: float) -> float:
        """Advance one step under this pressure."""
        if self._chamber is not None:
            self._chamber_pa = follow_ramp(self._chamber_pa, self._chamber, self._gauge_pa, pressure_pa)
            self._gauge_pa, pressure_pa = pressure_pa, self._chamber_pa
        else:
            self._gauge_pa = pressure_pa
        thrust_n = self._slide.area_m2 * pressure_pa
        loads_n = (thrust_n, self._side_n + self._side_share * thrust_n, self._more_out_n, self._disturbance_n)
        if (step := (self._slide, self.state, loads_n)) != self._stepped:  # else it moves nothing, like the one before
            self._stepped, self.state = step, advance_slide(*step, self._step_s, self._step_s)
        return self.state.force_n

    def _place(self) -> None:
        """Put the workpiece where it stands now; one that was taken away stands out of reach."""
        self._slide = with_gap(self._slide, self._surface_gap_m if self._touching else UNLIMITED)
