"""The two excitations that are shipped: one to fit, one to validate.

Made by

    envelope = Envelope(x=(0.073, 0.127), y=(0.043, 0.097), joint_speed=15.0, torque=0.35, conditioning=0.2)
    search(Search(Manipulator.thesis(), envelope), seed=1)      # and seed=2

of calibration.design, for the machine of the thesis 3 mm inside the shipped limits; docs/identification.md shows them.
"""

from typing import Final

from torquerig.calibration.excitation import FourierMotion
from torquerig.mechanism import HOME

FIT: Final = FourierMotion(
    start=HOME,
    period=1.75,
    periods=2,
    sines=(
        (0.007876452, -0.000692608, -0.001989753, -0.000951224, 0.000656584),
        (0.008374666, -0.00522604, -0.003720925, -0.000212711, 0.002818207),
    ),
    cosines=(
        (-0.001956181, 0.000304279, -0.004458794, 0.006697194, -0.002651476),
        (-0.007624332, -0.000594625, -0.00595922, 0.008582404, -0.002947306),
    ),
)
"""3.5 s, 700 samples at 5 ms as the thesis; condition number 3.8."""

VALIDATION: Final = FourierMotion(
    start=HOME,
    period=1.75,
    periods=2,
    sines=(
        (0.000391682, 0.003618507, -0.003943562, 0.004988618, -0.003150496),
        (-0.007374625, 0.005375428, -0.005596718, 0.007645129, -0.003433319),
    ),
    cosines=(
        (-0.001904515, 0.008542074, -0.000561055, -0.002031856, 0.000211816),
        (-0.005409103, 0.007979985, -0.002826877, 0.001135713, -0.000769614),
    ),
)
"""Another one of the kind, of 3.5 s, that is not fitted."""
