"""Sealed cases of Clearpath's Husky on Bullet: what the simulator (run.py) said, and what a "real" robot did.

    python make.py --out DIR --key FILE [--cases 50] [--length 90] [--seed N]

The real robot is the same engine with an effect put into its model, its ground or its sensors, or none. Which one is
sealed: the commitment (SHA-256 of the salted labels) is printed before anything is diagnosed, and `gyroid gap bench score` opens
them.
"""

import sys
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[1] / "common"), str(Path(__file__).parent)]

import numpy as np
import pybullet as bullet

import run
from cases import main, odd, size
from drives import Drive, Speeds
from sensors import unit_of

ROOT_ROW = run.ROW_S**0.5
WHEEL_RADIUS_M, HALF_TRACK_M = 0.17775, 0.2854  # of husky.urdf


def edited(radius=(1.0, 1.0), track=1.0):
    """husky.urdf with other radii (left, right) and another track, over nominal."""
    root = ET.parse(run.HUSKY).getroot()
    for side, names, over in zip((1, -1), (run.LEFT, run.RIGHT), radius, strict=True):
        for name in names:
            origin = root.find(f"joint[@name='{name}']/origin")
            x, y, z = map(float, origin.get("xyz").split())
            origin.set("xyz", f"{x} {side * abs(y) * track} {z}")
            cylinder = root.find(f"link[@name='{name}_link']/collision/geometry/cylinder")
            cylinder.set("radius", f"{float(cylinder.get('radius')) * over}")
    return ET.tostring(root, encoding="unicode")


class Body:
    """A Husky in a world; each setting is what the simulator lacks, and none at its default."""

    step_s = run.STEP_S

    def __init__(self, radius=(1.0, 1.0), track=1.0, tether_n_m=0.0, drag_n=0.0):
        with tempfile.NamedTemporaryFile("w", suffix=".urdf") as file:
            file.write(edited(radius, track))
            file.flush()
            self.husky = run.Husky(file.name)
        self.post, self.tether_n_m, self.drag_n = self.husky.centre()[:2], tether_n_m, drag_n

    def begin(self, steps):
        self.told, self.done = np.empty((steps + 1, 10)), 0

    def wheels_rad_s(self):
        return self.husky.sides()[1]

    def take_down(self):
        angles, speeds, torques = self.husky.sides()
        self.told[self.done] = self.husky.yaw_rate_rad_s(), *speeds, *(angles - self.husky.turned), *self.husky.moved(), *torques

    def pull(self):
        """Tether to a post where it began; one rear corner drags over the floor."""
        robot, (x, y, heading) = self.husky.robot, self.husky.centre()
        if self.tether_n_m:
            force = -self.tether_n_m * (np.array([x, y]) - self.post)
            bullet.applyExternalForce(robot, -1, [*force, 0], [x, y, 0.14], bullet.WORLD_FRAME)
        if self.drag_n:
            (vx, vy, _), (_, _, rate) = bullet.getBaseVelocity(robot)
            c, s = np.cos(heading), np.sin(heading)
            arm = np.array([-0.4 * c - 0.25 * s, -0.4 * s + 0.25 * c])
            speed = np.array([vx - rate * arm[1], vy + rate * arm[0]])
            force = -self.drag_n * speed / max(np.hypot(*speed), 0.005)
            bullet.applyExternalForce(robot, -1, [*force, 0], [x + arm[0], y + arm[1], 0.14], bullet.WORLD_FRAME)

    def step(self, speeds_rad_s):
        self.take_down()
        self.pull()
        self.husky.step(speeds_rad_s)
        self.done += 1

    def drive(self, commands_rad_s):
        """What it did since `begin`."""
        self.take_down()
        self.husky.close()
        rate, wheels, turned, place, heading, torques = np.split(self.told, [1, 3, 5, 7, 8], axis=1)
        velocity = np.gradient(place, self.step_s, axis=0)
        every = slice(None, -1, round(run.ROW_S / self.step_s))
        return Drive(self.step_s, rate[:, 0], wheels, turned, place, np.unwrap(heading[:, 0]), velocity, 2 * torques[every], commands_rad_s)


def nominal():
    """Sizes of the robot as the engine has it: Bullet gives a link without inertia one of its own."""
    husky = run.Husky()
    masses, places, yaw = [], [], []
    for link in range(-1, bullet.getNumJoints(husky.robot)):
        told = bullet.getDynamicsInfo(husky.robot, link)
        state = bullet.getBasePositionAndOrientation(husky.robot) if link < 0 else bullet.getLinkState(husky.robot, link)
        turn = np.array(bullet.getMatrixFromQuaternion(state[1])).reshape(3, 3)
        masses.append(told[0])
        places.append(state[0][:2])
        yaw.append((turn @ np.diag(told[2]) @ turn.T)[2, 2])
    spin = 2 * bullet.getDynamicsInfo(husky.robot, husky.wheels[0])[2][1]
    husky.close()
    masses, places = np.array(masses), np.array(places)
    off = places - masses @ places / masses.sum()
    return {"mass_kg": masses.sum(), "yaw_inertia_kg_m2": sum(yaw) + masses @ (off**2).sum(1), "half_track_m": HALF_TRACK_M,
            "wheel_radius_m": WHEEL_RADIUS_M, "wheel_inertia_kg_m2": spin, "viscous_friction_n_m_s": 0.0}


class Engine:
    name, cases = "pybullet", 50
    model, run_py = run.HUSKY, Path(run.__file__)
    inputs, without = ("command_left_rad_s", "command_right_rad_s"), ("torque",)
    steering = "differential"
    limits = {"yaw_acceleration_rad_s2": 2.0}  # at 4 the rear wheels lose their grip
    noise_per_root_hz, torque_noise_n_m_sqrt_s = run.COMMAND_STD_RAD_S * ROOT_ROW, 0.0
    unit = unit_of(run)
    nominal = nominal()
    listed = ()
    unlisted = (
        odd("tether", lambda d: {"tether_n_m": size(d, 5.0, 50.0)}),
        odd("corner_drags", lambda d: {"drag_n": size(d, 10.0, 60.0)}),
    )

    @staticmethod
    def described(world):
        return edited(**world)

    @staticmethod
    def body(world):
        return Body(**world)

    @staticmethod
    def controller(_draw):
        return Speeds(Engine.nominal)


if __name__ == "__main__":
    main(Engine, __doc__)
