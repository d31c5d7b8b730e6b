"""Where quadratics are positive, and what that leaves of a line."""

import numpy as np

from modrob_cli.arrays import Array, Indices


def positive_parts(A: Array, B: Array, C: Array, low: Array, high: Array) -> tuple[Array, Array, Indices]:
    """Open intervals of (low, high) in which A c^2 + B c + C > 0, for K quadratics.

    Parameters
    ----------
    A, B, C, low, high : shape (K,), low < high

    Returns
    -------
    start, end : shape (P,), the parts that are not empty, at most two for a quadratic
    owner : number of the quadratic of each part, shape (P,)
    """
    with np.errstate(all="ignore"):
        root = np.sqrt(B * B - 4.0 * A * C)
        # Without cancellation: the larger root in size first, the other one from their product.
        h = -0.5 * (B + np.where(B >= 0.0, root, -root))
        first, second = h / A, C / h
        second = np.where(h == 0.0, 0.0, second)
        r1, r2 = np.fmin(first, second), np.fmax(first, second)
        linear = -C / B
    real = ~np.isnan(root)
    opens_up, opens_down, straight = A > 0.0, A < 0.0, A == 0.0
    two, between = opens_up & real, opens_down & real
    everywhere = (opens_up & ~real) | (straight & (B == 0.0) & (C > 0.0))
    rising, falling = straight & (B > 0.0), straight & (B < 0.0)
    # A first part, which most quadratics have, and a second one after r2. Nothing: it starts and ends at infinity.
    cases = [two, between, everywhere, rising, falling]
    never = np.full_like(A, np.inf)
    start = np.stack([np.select(cases, [-never, r1, -never, linear, -never], never), np.where(two, r2, never)])
    end = np.stack([np.select(cases, [r1, r2, never, never, linear], -never), never])
    start, end = np.maximum(start, low), np.minimum(end, high)
    kept = start < end
    return start[kept], end[kept], np.nonzero(kept)[1]


def uncovered(start: Array, end: Array, low: float, high: float) -> list[tuple[float, float]]:
    """Parts of [low, high] that no interval (start, end) covers, in order; single points do not count."""
    order = np.argsort(start, kind="stable")
    start, end = start[order], end[order]
    reach = np.maximum.accumulate(np.concatenate([[low], end]))
    free = [(float(reach[k]), float(start[k])) for k in np.flatnonzero(start > reach[:-1])]
    return [*free, (float(reach[-1]), high)] if reach[-1] < high else free
