"""The 6-axis arm of [D] Table 3.4 from its modules, against the published tables.

Source of the numbers: public MATLAB module data base AndreaGiusti/OTFCtrlModRob and Timor's IMPROV set; the D-H and
link tables are what the public MATLAB code gives for them, of which [D] Table 3.4 prints the rounded digits.
"""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from modrob_cli.cli.app import app

ROOT = Path(__file__).parents[2]
HALF_PI = math.pi / 2

# alpha, a, d, theta - q, p, n
DH = [
    (-HALF_PI, 0.0, 0.1013, 0.0, -0.1013, 0.1013),
    (math.pi, 0.35, 0.1013, -HALF_PI, 0.0, 0.0),
    (-HALF_PI, 0.0, 0.1013, -HALF_PI, -0.1013, 0.1013),
    (HALF_PI, 0.0, 0.3012, 0.0, -0.1999, -0.0748),
    (-HALF_PI, 0.0, 0.0, 0.0, -0.0748, 0.0748),
    (0.0, 0.0, 0.1548, 0.0, -0.08, 0.0),
]
# mass; com; I_xx, I_yy, I_zz, I_yz about the centre of mass in 1e-3 kg m^2, as printed
MASS = [3.9, 1.62, 3.9, 1.0, 1.8, 1.5]
COM = [
    (0, 0.018, 0.0193),
    (-0.175, 0, -0.0132),
    (0, 0.018, 0.0193),
    (-0.00018, -0.1289, -0.0477),
    (0, 0.012, 0.0118),
    (0, 0, -0.042),
]
INERTIA = [
    ("15.312", "11.577", "9.7334", "-5.7564"),
    ("16.850", "24.443", "24.725", "-0.006"),
    ("15.312", "11.577", "9.7334", "-5.7564"),
    ("6.5927", "1.6177", "5.8530", "1.8243"),
    ("5.4166", "4.0558", "2.9408", "-1.3608"),
    ("1.8647", "1.7647", "0.6331", "0"),
]


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """JSON of ``modrob assemble`` for the shipped arm."""
    out = tmp_path_factory.mktemp("lwa4p")
    result = CliRunner().invoke(
        app, ["assemble", str(ROOT / "assemblies" / "lwa4p-6.yaml"), "-o", str(out), "--json"], catch_exceptions=False
    )
    assert result.exit_code == 0, result.stderr
    found: dict[str, Any] = json.loads(result.stdout)["robots"][0]
    return found


def test_dh_parameters(robot: dict[str, Any]) -> None:
    got = [[row[key] for key in ("alpha", "a", "d", "theta", "p", "n")] for row in robot["dh"]]
    np.testing.assert_allclose(got, DH, rtol=0.0, atol=1e-9)


def test_base_and_tool_transforms_are_identities(robot: dict[str, Any]) -> None:
    np.testing.assert_allclose(robot["base_transform"], np.eye(4), rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(robot["tool_transform"], np.eye(4), rtol=0.0, atol=1e-12)


def test_link_parameters_to_every_printed_digit(robot: dict[str, Any]) -> None:
    for link, mass, com, printed in zip(robot["links"], MASS, COM, INERTIA, strict=True):
        assert link["mass"] == pytest.approx(mass, abs=1e-12)
        np.testing.assert_allclose(link["com"], com, rtol=0.0, atol=1e-9)
        xx, _, _, yy, yz, zz = link["inertia_com"]
        for value, text in zip((xx, yy, zz, yz), printed, strict=True):
            digits = len(text.partition(".")[2])
            # half a unit of the last printed digit; I_zz of link 2 is exactly 24.7255, printed rounded down
            assert abs(1e3 * value - float(text)) <= 0.5 * 10.0**-digits + 1e-9


def test_drive_data(robot: dict[str, Any]) -> None:
    """[D] Table 3.4: viscous and Coulomb friction, rotor inertia, gear ratio, torque constant."""
    keys = ("viscous", "coulomb", "rotor_inertia", "gear_ratio", "torque_constant")
    expected = [
        (15.68, 7.14, 5.23e-5, 160, 0.0429),
        (13.91, 5.10, 5.23e-5, 160, 0.0429),
        (17.89, 6.84, 5.23e-5, 160, 0.0429),
        (13.63, 6.91, 5.23e-5, 160, 0.0429),
        (4.45, 2.12, 1.7e-5, 100, 0.1),
        (4.67, 2.33, 1.7e-5, 100, 0.1),
    ]
    assert [tuple(link[key] for key in keys) for link in robot["links"]] == expected
