"""Up to which speed the sign of the friction is unknown: the band that makes the torque bounds narrowest."""

from dataclasses import replace

import numpy as np

from modrob_cli.identify.bounded_answers import Answers
from modrob_cli.identify.bounded_error import JointRequest, untold
from modrob_cli.identify.bounded_samples import JointSamples

SHARES = (0.0, 0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.14, 0.2, 0.28, 0.4)
"""Bands that are tried, as shares of the RMS velocity."""

DIGITS = ".3g"


def narrowest_velocity_band(samples: JointSamples, request: JointRequest) -> float:
    """Velocity band, of those tried, with the least mean width of the bounds; the smallest of equals.

    A wide band costs width at the samples within it, a narrow one at those where the recorded friction still turns
    over (a filter blurs the jump, and a real joint has none). The width is not linear in the band, so a few are tried.

    Raises
    ------
    NumericalError
        If the solver fails.
    """
    size = float(np.sqrt(np.mean(samples.dq**2)))
    best, least = 0.0, np.inf
    for band in sorted({float(f"{share * size:{DIGITS}}") for share in SHARES}):
        tried = replace(samples, velocity_band=band)
        answers = Answers(tried, untold(tried, request), request.noise)
        width = tried.mean_width(answers.least_width(answers.sought, request.noise).ends)
        if width < least:
            best, least = band, width
    return best
