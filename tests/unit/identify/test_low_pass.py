"""The filter against SciPy's own forward-backward filter."""

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from modrob_cli.identify.signals import ORDER, low_pass


@pytest.mark.parametrize("shape", [(1,), (2,), (30,), (700,), (700, 1), (700, 3)])
@pytest.mark.parametrize(("rate", "cutoff"), [(250.0, 40.0), (1000.0, 7.3)])
def test_same_as_scipy(shape: tuple[int, ...], rate: float, cutoff: float) -> None:
    x = np.random.default_rng(1).normal(size=shape)
    sections = butter(ORDER, cutoff, fs=rate, output="sos")
    pad = min(len(x) - 1, int(np.ceil(rate / cutoff)))
    for signal in (x, x[::-1]):
        expected = sosfiltfilt(sections, signal, axis=0, padlen=pad)
        # The same operations in the same order; a rounding error is left to other versions of SciPy.
        np.testing.assert_allclose(low_pass(signal, rate, cutoff), expected, rtol=0, atol=1e-12)
