r"""Inertial parameters that real bodies have, as free numbers.

The pseudo-inertia :math:`J = \begin{pmatrix}\Sigma & h\\ h' & m\end{pmatrix}` of a real body is positive definite
(P. Wensing, S. Kim, J.-J. Slotine, RA-L 2018). Written as :math:`J = L_0 U U' L_0'` with upper triangular
:math:`U(\theta)` of positive diagonal, it is so for any ten numbers theta, and :math:`\theta = 0` gives the body
:math:`J_0 = L_0 L_0'` (C. Rucker, P. Wensing, "Smooth parameterization of rigid-body inertia", RA-L 2022, eq. 11).
"""

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.link_inertia import LinearParameters
from modrob_cli.identify.base_columns import TENSOR_ORDER
from modrob_cli.model.body import tensor, tensor_entries
from modrob_cli.model.realizable import second_moments
from modrob_cli.spatial import parallel_axis

SMALLEST_RADIUS = 2e-3
"""Bodies thinner than this about their centre of mass are taken as this thick: root of second moment / mass [m]."""

_UPPER = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))


def pseudo_inertia(link: LinearParameters) -> Array:
    """Matrix J of second, first and zeroth moments about the link's origin, shape (4, 4)."""
    J = np.empty((4, 4))
    J[:3, :3] = second_moments(link.inertia)
    J[:3, 3] = J[3, :3] = link.moment
    J[3, 3] = link.mass
    return J


def linear_parameters(J: Array) -> Array:
    """The ten linear parameters in the order of the torque regressor, shape (..., 10), of matrices J (..., 4, 4)."""
    moments = J[..., :3, :3]
    inertia = np.trace(moments, axis1=-2, axis2=-1)[..., None, None] * np.eye(3) - moments
    return np.concatenate([J[..., 3, 3:], J[..., :3, 3], tensor_entries(inertia)[..., TENSOR_ORDER]], axis=-1)


def nearest_consistent(link: LinearParameters) -> LinearParameters:
    """The same mass and centre of mass with a tensor that a real body has: negative second moments are cut off.

    Of all such tensors it is the nearest in the Frobenius norm of the second moments (N. Higham, Linear Algebra and its
    Applications 103 (1988), theorem 2.1), except that none is below :data:`SMALLEST_RADIUS`.
    """
    mass, com, central = link.central()
    values, vectors = np.linalg.eigh(second_moments(central))
    lifted = (vectors * np.maximum(values, mass * SMALLEST_RADIUS**2)) @ vectors.T
    inertia = np.trace(lifted) * np.eye(3) - lifted + mass * parallel_axis(com)
    return LinearParameters(mass, link.moment, inertia)


def body_from(theta: Array, root: Array) -> tuple[Array, Array]:
    """Body of the numbers theta, shape (10,), relative to the one with J_0 = root root'.

    Returns
    -------
    pi : the ten linear parameters in the order of the torque regressor, shape (10,)
    slopes : their derivatives with respect to theta, shape (10, 10)
    """
    diagonal = np.append(np.exp(theta[1:4]), 1.0)
    U = np.diag(diagonal)
    for k, place in enumerate(_UPPER):
        U[place] = theta[4 + k]
    half = np.exp(theta[0]) * root @ U
    steps = np.zeros((10, 4, 4))
    steps[0] = U
    for k in range(3):
        steps[1 + k, k, k] = diagonal[k]
    for k, place in enumerate(_UPPER):
        steps[(4 + k, *place)] = 1.0
    moved = np.exp(theta[0]) * root @ steps @ half.T
    both = np.concatenate([(half @ half.T)[None], moved + np.swapaxes(moved, 1, 2)])
    pi = linear_parameters(both)
    return pi[0], pi[1:].T


def from_parameter_vector(pi: Array) -> LinearParameters:
    """A link of the ten linear parameters, shape (10,)."""
    entries = np.empty(6)
    entries[TENSOR_ORDER] = pi[4:]
    return LinearParameters(float(pi[0]), pi[1:4].copy(), tensor(entries))
