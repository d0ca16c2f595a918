"""robot.xml and its ground, with what may be wrong with either.

The robot has two driven wheels (thin ellipsoids, one point of contact each) and a caster before and one behind the axle. Contacts
are nearly rigid, so that wheels roll unless a `World` says otherwise. All quantities in SI units; x forward, y left, z up.
"""

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from drives import Drive

ROBOT_XML = Path(__file__).with_name("robot.xml")
STEP_S = 0.0005  # how often its state is taken down, s
GRAVITY_M_S2 = 9.81


@dataclass(frozen=True)
class Robot:
    """What the team believes of its robot; the defaults are those of robot.xml."""

    mass_kg: float = 12.0  # with wheels
    yaw_inertia_kg_m2: float = 0.21  # about the vertical axis through the centre of mass, with wheels
    half_track_m: float = 0.17
    wheel_radius_m: float = 0.065
    wheel_mass_kg: float = 0.45
    viscous_friction_n_m_s: float = 0.004
    torque_noise_n_m_sqrt_s: float = 0.001

    @property
    def wheel_inertia_kg_m2(self):
        """About the axle: a disc with most of its mass at the rim."""
        return 0.7 * self.wheel_mass_kg * self.wheel_radius_m**2


@dataclass(frozen=True)
class World:
    """What is so in the engine's world and not in the nominal simulator; the defaults hold nothing."""

    radius: tuple = (1.0, 1.0)  # left, right, over nominal
    track: float = 1.0  # over nominal
    load_kg: float = 0.0  # a body fixed above the axle
    load_inertia_kg_m2: float = 0.0  # of that body about its own vertical axis
    load_ahead_m: float = 0.0  # of that body, ahead of the axle
    load_spring: tuple = None  # frequency Hz, damping ratio: the load slides along x and y on springs instead
    load_falls_s: float = None  # the load is held by a weld that lets go at this time
    com_ahead_m: float = 0.0
    friction_n_m: float = 0.0  # dry friction in each wheel's joint
    damping_n_m_s: float = 0.0  # of each wheel's joint, beyond what the team believes
    gain: tuple = (1.0, 1.0)  # left, right motor over nominal
    torque_limit_n_m: float = None
    motor_lag_s: float = None
    slope_rad: float = 0.0
    uphill_rad: float = 0.0
    grip: float = 1.0  # coefficient of friction of the wheels
    slide_s: float = 0.0005  # time constant with which the ground takes away a sliding speed; sideways it makes the robot skid
    stiffness: float = 100.0  # MuJoCo's impratio: below 1, a force makes the contact creep
    guided: bool = False  # the chassis may rise and roll and cannot pitch, and has no casters: for wheels on uneven ways
    swivel: bool = False  # a trailing wheel on a vertical hinge behind a guided chassis
    eccentric_m: float = 0.0  # the left wheel's axle beside its centre
    cables: int = 0  # number of cables of `cable_m` radius laid over the floor
    cable_m: float = 0.004
    hooks: tuple = ()  # called as hook(model, data, time_s) before each step
    noise_within_row: bool = False  # torque noise white within a row instead of held over it


RIGID = 'solref="0.001 1" solimp="0.9999 0.9999 0.001 0.5 2"'
ROLLING = 'solref="0.004 1" solimp="0.99 0.99 0.001 0.5 2"'  # wheels: stiff, and never off the ground
SUPPORT = 'solref="0.004 1" solimp="0.9 0.9 0.001 0.5 2"'  # casters give way by microns, so that the wheels bear the weight
LOAD_HEIGHT_M = 0.08
CASTER_M = (0.14, 0.02)  # from the axle; radius of its ball
SWIVEL_N, SWIVEL_KG, TRAIL_M = 20.0, 0.08, 0.03  # load, mass and trail of the swivel
GUIDED = """<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/><joint type="slide" axis="0 0 1"/>
      <joint type="hinge" axis="0 0 1"/><joint type="hinge" axis="1 0 0"/>"""


def chassis_inertial(robot, world):
    """Mass, x of its centre (m) and yaw inertia of the chassis, so that robot and wheels add up to the nominal mass and yaw
    inertia with the centre of mass `com_ahead_m` ahead of the axle, whatever track and radii are."""
    mass = robot.mass_kg - 2 * robot.wheel_mass_kg - (SWIVEL_KG if world.swivel else 0.0)
    ahead, half_track = world.com_ahead_m, robot.half_track_m * world.track
    x = ahead * robot.mass_kg / mass
    across = robot.wheel_inertia_kg_m2 * 0.55
    wheels = 2 * (robot.wheel_mass_kg * (half_track**2 + ahead**2) + across)
    return mass, x, robot.yaw_inertia_kg_m2 - wheels - mass * (x - ahead) ** 2


def wheels(root, robot, world):
    """Sets the wheels, their joints, contacts and motors."""
    along, across = robot.wheel_inertia_kg_m2, robot.wheel_inertia_kg_m2 * 0.55
    for name, side, radius, gear in zip(("left", "right"), (1, -1), world.radius, world.gain, strict=True):
        r = robot.wheel_radius_m * radius
        body = root.find(f".//body[@name='{name}']")
        body.set("pos", f"0 {side * robot.half_track_m * world.track} {r - robot.wheel_radius_m}")
        body.find("joint").attrib |= {"damping": f"{robot.viscous_friction_n_m_s + world.damping_n_m_s}", "frictionloss": f"{world.friction_n_m}"}
        body.find("inertial").attrib |= {"mass": f"{robot.wheel_mass_kg}", "diaginertia": f"{across} {along} {across}"}
        body.find("geom").attrib |= {"size": f"{r} {0.25 * r} {r}", "pos": f"{world.eccentric_m if side > 0 else 0.0} 0 0"}
        pair = root.find(f"contact/pair[@name='{name}']")
        pair.attrib |= {"friction": f"{world.grip} {world.grip}", "solreffriction": f"{world.slide_s} 1"}
        motor = root.find(f"actuator/general[@name='{name}']")
        motor.set("gear", f"{gear}")
        if world.motor_lag_s:
            motor.attrib |= {"dyntype": "filterexact", "dynprm": f"{world.motor_lag_s}"}
        if world.torque_limit_n_m:
            motor.attrib |= {"forcelimited": "true", "forcerange": f"{-world.torque_limit_n_m} {world.torque_limit_n_m}"}


def guide(root, robot, world):
    """Takes the casters away, and holds the chassis from pitching instead; a trailing wheel on a vertical hinge where asked for."""
    chassis, contact = root.find(".//body[@name='chassis']"), root.find("contact")
    for name in ("front", "rear"):
        chassis.remove(chassis.find(f"geom[@name='{name}']"))
        contact.remove(contact.find(f"pair[@name='{name}']"))
    chassis.remove(chassis.find("freejoint"))
    chassis[0:0] = parsed(GUIDED)
    if not world.swivel:
        return
    at, ball = CASTER_M
    chassis[6:6] = parsed(f"""<body name="swivel" pos="{-at} 0 {ball - robot.wheel_radius_m}">
          <joint name="spring" type="slide" axis="0 0 1" stiffness="4000" springref="{-SWIVEL_N / 4000}" damping="40"/>
          <joint name="swivel" type="hinge" axis="0 0 1" frictionloss="0.02" damping="0.001"/>
          <inertial pos="0 0 0" mass="0.02" diaginertia="1e-5 1e-5 1e-5"/>
          <body name="rear" pos="{-TRAIL_M} 0 0"><joint name="roll" type="hinge" axis="0 1 0" damping="0.0002"/>
            <inertial pos="0 0 0" mass="{SWIVEL_KG - 0.02}" diaginertia="1e-5 2e-5 1e-5"/>
            <geom name="rear" type="ellipsoid" size="{ball} {0.4 * ball} {ball}"/></body></body>""")
    contact[2:2] = parsed(f'<pair geom1="floor" geom2="rear" condim="3" friction="0.8 0.8" {SUPPORT}/>')


def parsed(fragment):
    """Elements of a piece of XML."""
    return list(ET.fromstring(f"<_>{fragment}</_>"))


def load(root, robot, world):
    """Adds the load above the axle: fixed, on springs, or held by a weld (then a body of the floor's world)."""
    j = world.load_inertia_kg_m2
    inertial = f'<inertial pos="0 0 0" mass="{world.load_kg}" diaginertia="{j} {j} {j}"/>'
    joints = ""
    if world.load_spring:
        hz, ratio = world.load_spring
        k, c = world.load_kg * (2 * np.pi * hz) ** 2, 2 * ratio * world.load_kg * 2 * np.pi * hz
        joints = "".join(f'<joint type="slide" axis="{a}" stiffness="{k}" damping="{c}"/>' for a in ("1 0 0", "0 1 0"))
    if world.load_falls_s is None:
        body = f'<body name="load" pos="{world.load_ahead_m} 0 {LOAD_HEIGHT_M}">{joints}{inertial}</body>'
        root.find(".//body[@name='chassis']").extend(parsed(body))
        return
    high = robot.wheel_radius_m + LOAD_HEIGHT_M
    root.find("worldbody").extend(parsed(f'<body name="load" pos="{world.load_ahead_m} 0 {high}"><freejoint/>{inertial}</body>'))
    root.extend(parsed(f'<equality><weld name="strap" body1="chassis" body2="load" {RIGID}/></equality>'))


def cables(root, world):
    """Lays thin cables over the floor at random."""
    draw, geoms, pairs = np.random.default_rng(5), "", ""
    for i in range(world.cables):
        x, y = draw.uniform(-5, 5, 2)
        turn = draw.uniform(0, 180)
        geoms += f'<geom name="cable{i}" type="capsule" size="{world.cable_m} 1.5" pos="{x} {y} 0" zaxis="{np.cos(turn)} {np.sin(turn)} 0"/>'
        pairs += "".join(f'<pair geom1="cable{i}" geom2="{w}" condim="3" friction="1 1" {ROLLING}/>' for w in ("left", "right"))
    root.find("worldbody")[1:1] = parsed(geoms)
    root.find("contact").extend(parsed(pairs))


def mjcf(robot, world):
    """The model as an MJCF string: robot.xml with the sizes of `robot`, and what `world` holds."""
    root = ET.parse(ROBOT_XML).getroot()
    a, psi = world.slope_rad, world.uphill_rad
    gravity = -GRAVITY_M_S2 * np.array([np.sin(a) * np.cos(psi), np.sin(a) * np.sin(psi), np.cos(a)])
    root.find("option").attrib |= {"gravity": f"{gravity[0]} {gravity[1]} {gravity[2]}", "impratio": f"{world.stiffness}"}
    mass, x, yaw = chassis_inertial(robot, world)
    chassis, (at, ball) = root.find(".//body[@name='chassis']"), CASTER_M
    chassis.set("pos", f"0 0 {robot.wheel_radius_m - 1e-7}")
    chassis.find("inertial").attrib |= {"pos": f"{x} 0 0.02", "mass": f"{mass}", "diaginertia": f"{0.6 * yaw} {0.8 * yaw} {yaw}"}
    for name, ahead in (("front", at), ("rear", -at)):
        chassis.find(f"geom[@name='{name}']").set("pos", f"{ahead} 0 {ball - robot.wheel_radius_m}")
    wheels(root, robot, world)
    if world.guided:
        guide(root, robot, world)
    if world.load_kg:
        load(root, robot, world)
    cables(root, world)
    return ET.tostring(root, encoding="unicode")


def compiled(robot, world):
    return mujoco.MjModel.from_xml_string(mjcf(robot, world))


def wheel_dofs(model):
    """Addresses of the left and right wheel in qvel."""
    return [model.jnt_dofadr[mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, n)] for n in ("left", "right")]


def nominal(robot, believed=World()):
    """Mass (kg), yaw inertia about the centre of mass and wheel inertia (kg m²), wheel radius and half track (m), viscous friction
    (N m s) of the compiled model of what the team believes: from the engine's joint-space inertia at rest."""
    model = compiled(robot, believed)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    left = wheel_dofs(model)[0]
    mass = full[0, 0].item()
    ahead = data.subtree_com[0] - data.qpos[:3]
    size = model.geom("left").size
    return {
        "mass_kg": mass,
        "yaw_inertia_kg_m2": full[5, 5].item() - mass * (ahead[0] ** 2 + ahead[1] ** 2).item(),
        "half_track_m": 0.5 * (data.xpos[model.body("left").id][1] - data.xpos[model.body("right").id][1]).item(),
        "wheel_radius_m": size[0].item(),
        "wheel_inertia_kg_m2": full[left, left].item(),
        "viscous_friction_n_m_s": model.dof_damping[left].item(),
    }


class Body:
    """A robot in a world, as the engine moves it."""

    step_s = STEP_S

    def __init__(self, robot, world):
        self.model, self.world = compiled(robot, world), world
        self.data = mujoco.MjData(self.model)
        self.within = round(STEP_S / self.model.opt.timestep)
        self.dofs = wheel_dofs(self.model)

    def begin(self, steps):
        self.told_q, self.told_v = np.empty((steps + 1, self.model.nq)), np.empty((steps + 1, self.model.nv))
        self.done = 0

    def wheels_rad_s(self):
        return self.data.qvel[self.dofs]

    def take_down(self):
        self.told_q[self.done], self.told_v[self.done] = self.data.qpos, self.data.qvel

    def step(self, torques_n_m):
        self.take_down()
        self.data.ctrl[:] = torques_n_m
        for hook in self.world.hooks:
            hook(self.model, self.data, self.done * STEP_S)
        mujoco.mj_step(self.model, self.data, self.within)
        self.done += 1

    def drive(self, torques_n_m):
        """What it did since `begin`."""
        self.take_down()
        q, v = self.told_q, self.told_v
        angles = [self.model.jnt_qposadr[self.model.dof_jntid[dof]] for dof in self.dofs]
        if self.world.guided:
            heading, rate = q[:, 3], v[:, 3]
        else:
            w, x, y, z = q[:, 3:7].T
            heading, rate = np.unwrap(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))), v[:, 5]
        return Drive(STEP_S, rate, v[:, self.dofs], q[:, angles], q[:, :2], heading, v[:, :2], torques_n_m)
