"""What is true of a simulated drive, whether or not its objects say so."""

from dataclasses import dataclass, field

from torquerig.device_sim.canopen.core import NodeTiming


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveParameters:
    """The hardware of one drive and motor: Sanyo Denki P50B05010D with the thesis' torque scale.

    Attributes:
        gain_positive: Counts that make 1 N·m in the positive direction (thesis, Figure 5.5) [counts/(N·m)].
        gain_negative: Counts that make 1 N·m in the negative direction (thesis, Figure 5.5) [counts/(N·m)].
        nominal_gain: What the firmware believes of both directions (thesis, 5.4.1) [counts/(N·m)].
        rated_torque: Torque that may flow for ever [N·m].
        peak_torque: Where the current loop saturates [N·m].
        encoder_counts: Edges of the encoder in a motor revolution, 2000 P/R x 4.
        control_period_ns: Step of ramps [ns].
        supervision_ns: Period of the slow protections; fast ones act at once [ns].
        dc_link: Voltage of the DC link [mV].
        dc_link_maximum: Where overvoltage trips [mV].
        ambient: Temperature of drive and motor when cold [°C].
        device_rise: How much warmer the power stage gets at rated torque [°C].
        device_time_constant: Of the power stage [s].
        device_maximum: Where its over-temperature trips [°C].
        motor_rise: How much warmer the winding gets at rated torque [°C].
        motor_time_constant: Of the winding [s].
        motor_maximum: Where its over-temperature trips [°C].
        hysteresis: How far temperatures must fall below their maximum before the fault can be reset [°C].
        i2t_reset_load: The share of the trip level that I2t must fall below before the fault can be reset.
        homing_speed: Fastest that a motor may turn when its position is set by homing [counts/s].
        timing: How long the drive takes to hear, act and answer.
    """

    gain_positive: float = 20670.0
    gain_negative: float = 19528.0
    nominal_gain: float = 20100.0
    rated_torque: float = 0.319
    peak_torque: float = 0.98
    encoder_counts: int = 8000
    control_period_ns: int = 100_000
    supervision_ns: int = 50_000_000
    dc_link: int = 280_000
    dc_link_maximum: int = 400_000
    ambient: float = 30.0
    device_rise: float = 30.0
    device_time_constant: float = 300.0
    device_maximum: float = 85.0
    motor_rise: float = 75.0
    motor_time_constant: float = 600.0
    motor_maximum: float = 130.0
    hysteresis: float = 10.0
    i2t_reset_load: float = 0.9
    homing_speed: float = 1000.0
    timing: NodeTiming = field(default_factory=NodeTiming)

    def gain(self, torque: float) -> float:
        """Counts per N·m in the direction of a torque, or of counts [counts/(N·m)]."""
        return self.gain_positive if torque >= 0.0 else self.gain_negative
