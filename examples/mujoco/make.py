"""Sealed cases of the two-wheel robot in MuJoCo: what the simulator (run.py) said, and what a "real" robot did.

    python make.py --out DIR --key FILE [--cases 100] [--length 90] [--seed N]

The real robot is the same engine with an effect put into its bodies, joints, contacts or sensors, or none. Which one is sealed:
the commitment (SHA-256 of the salted labels) is printed before anything is diagnosed, and `gyroid gap bench score` opens them.
"""

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[1] / "common"), str(Path(__file__).parent)]

import run
from cases import Case, either, main, odd, ratio, size
from drives import Controller
from hooks import CasterDrag, Sag, Tether
from sensors import unit_of
from worlds import GRAVITY_M_S2, ROBOT_XML, Body, Robot, World, mjcf, nominal

ROBOT = Robot()
ROOT_ROW = run.ROW_S**0.5


def motors(draw):
    gamma, gains = ratio(draw, 0.01, 0.1)
    return Case({"motor.torque_gain": {"right_over_left_minus_one": gamma}}, {"gain": gains})


def payload(draw):
    m, j = size(draw, 0.03, 0.4), size(draw, 0.02, 0.3)
    load = {"load_kg": m * ROBOT.mass_kg, "load_inertia_kg_m2": j * ROBOT.yaw_inertia_kg_m2}
    return Case({"vehicle.payload": {"mass_relative": m, "inertia_relative": j}}, load)


def offset(draw):
    d = either(draw, 0.008, 0.05)
    return Case({"vehicle.com_offset": {"offset_m": d}}, {"com_ahead_m": d})


def resistance(draw):
    c = size(draw, 0.003, 0.03)
    each = c * ROBOT.mass_kg * GRAVITY_M_S2 * ROBOT.wheel_radius_m / 2
    return Case({"wheel.rolling_resistance": {"coefficient": c}}, {"friction_n_m": each})


def damping(draw):
    """Viscous friction of the joints is resistance that grows with speed: at 0.5 m/s it is the coefficient."""
    a = size(draw, 0.006, 0.06)
    each = a * ROBOT.mass_kg * GRAVITY_M_S2 * ROBOT.wheel_radius_m**2 / 2
    return Case({"wheel.rolling_resistance": {"coefficient": 0.5 * a, "rise_s_per_m": a}}, {"damping_n_m_s": each})


def slope(draw):
    a, psi = size(draw, 0.003, 0.03), float(draw.uniform(-3.14, 3.14))
    return Case({"ground.slope": {"slope_rad": a, "uphill_heading_rad": psi}}, {"slope_rad": a, "uphill_rad": psi})


class Engine:
    name, cases = "mujoco", 100
    model, run_py = ROBOT_XML, Path(run.__file__)
    inputs, without = ("torque_left_n_m", "torque_right_n_m"), ()
    steering, limits = "differential", {}
    noise_per_root_hz = torque_noise_n_m_sqrt_s = run.TORQUE_STD_N_M * ROOT_ROW
    unit = unit_of(run)
    nominal = nominal(ROBOT)
    listed = (motors, payload, offset, resistance, damping, slope)
    unlisted = (
        odd("tether", lambda d: {"hooks": (Tether(size(d, 0.3, 3.0)),)}),
        odd("caster_drags", lambda d: {"hooks": (CasterDrag(size(d, 0.3, 3.0)),)}),
        odd("wheel_eccentric", lambda d: {"guided": True, "eccentric_m": size(d, 0.0008, 0.003)}),
        odd("motor_lags", lambda d: {"motor_lag_s": size(d, 0.02, 0.1)}),
        odd("motor_saturates", lambda d: {"torque_limit_n_m": float(d.uniform(0.25, 0.5))}),
        odd("battery_sags", lambda d: {"hooks": (Sag(float(d.uniform(0.6, 0.85)), 90.0),)}),
    )

    @staticmethod
    def described(world):
        return mjcf(ROBOT, World(**world))

    @staticmethod
    def body(world):
        return Body(ROBOT, World(**world))

    @staticmethod
    def controller(draw):
        return Controller(Engine.nominal, run.ENCODER_STD_RAD_S, draw)


if __name__ == "__main__":
    main(Engine, __doc__)
