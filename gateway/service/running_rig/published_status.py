"""From control's decision to the status that the registers show."""

from dataclasses import dataclass, field
from math import nan
from typing import NamedTuple

from gateway.control.inputs import Output
from gateway.registers.command import Status


@dataclass(slots=True)
class LoopHealth:
    """Health of the loop: work time of the last step, ticks missed, and a histogram of lateness in powers of 2 us."""

    loop_time_s: float = nan
    ticks: int = 0
    missed_ticks: int = 0
    lateness: list[int] = field(default_factory=lambda: [0] * 32)

    def count(self, expirations: int, late_s: float) -> None:
        """Count one tick. expirations: periods since the last one; late_s: lateness."""
        self.ticks += expirations
        self.missed_ticks += expirations - 1
        self.lateness[min(31, int(late_s * 1e6).bit_length()) if late_s > 0.0 else 0] += 1

    def lateness_us(self, share: float) -> int:
        """Return the upper bound in us of the lateness that this share of the ticks stayed under."""
        wanted_ticks, ticks = share * sum(self.lateness), 0
        for bits, count in enumerate(self.lateness):
            ticks += count
            if ticks >= wanted_ticks and ticks:
                return 1 << bits
        return 0


class BackgroundStatus(NamedTuple):
    """Status that the service knows beside the loop: calibrations and plant by number, and the residual watch's cause."""

    calibration_id: int
    calibration_stored: int = 0
    residual_cause: int = 0
    plant_id: int = 0


def status_of(output: Output, health: LoopHealth, pressure_pa: float, known: BackgroundStatus) -> Status:
    """Return the status that the registers show. pressure_pa: of the output device, nan where it measures none."""
    return Status(
        state=output.state,
        status_word=int(output.status),
        force_measured_n=output.force_measured_n,
        force_requested_n=output.force_requested_n,
        force_accepted_n=output.force_accepted_n,
        force_applied_n=output.force_applied_n,
        output_voltage_v=output.voltage_v,
        feedforward_v=output.feedforward_v,
        trim_v=output.trim_v,
        limited_by=output.limited_by,
        fault_code=output.fault,
        warning_word=int(output.warnings),
        sample_age_s=output.sample_age_s,
        loop_time_s=health.loop_time_s,
        heartbeat_echo=output.heartbeat_echo,
        sequence_echo=output.sequence_echo,
        calibration_id=known.calibration_id,
        model_residual_n=output.model_residual_n,
        pressure_pa=pressure_pa,
        missed_ticks=health.missed_ticks,
        calibration_phase=output.calibration_phase,
        calibration_progress=output.calibration_progress,
        calibration_time_left_s=output.calibration_time_left_s,
        calibration_stored=known.calibration_stored,
        residual_cause=known.residual_cause,
        plant_id=known.plant_id,
    )
