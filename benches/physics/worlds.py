"""The robot and its ground as MuJoCo sees them, with what may be wrong with either.

The robot has two driven wheels (thin ellipsoids, one point of contact each) and a caster before and one behind the axle. Contacts
are nearly rigid, so that wheels roll unless a `World` says otherwise. All quantities in SI units; x forward, y left, z up.
"""

from dataclasses import dataclass, field, replace

import mujoco
import numpy as np

ENGINE_STEP_S = 0.00025
STEP_S = 0.0005  # how often its state is taken down, s
GRAVITY_M_S2 = 9.81


@dataclass(frozen=True)
class Robot:
    """What the team believes of its robot."""

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
    extra: dict = field(default_factory=dict)


RIGID = 'solref="0.001 1" solimp="0.9999 0.9999 0.001 0.5 2"'
ROLLING = 'solref="0.004 1" solimp="0.99 0.99 0.001 0.5 2"'  # wheels: stiff, and never off the ground
SUPPORT = 'solref="0.004 1" solimp="0.9 0.9 0.001 0.5 2"'  # casters give way by microns, so that the wheels bear the weight
LOAD_HEIGHT_M = 0.08
CASTER_M = (0.14, 0.02)  # from the axle; radius of its ball
SWIVEL_N, SWIVEL_KG, TRAIL_M = 20.0, 0.08, 0.03  # load, mass and trail of the swivel
FREE = "<freejoint/>"
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



def wheel(name, side, robot, world):
    r = robot.wheel_radius_m * world.radius[0 if side > 0 else 1]
    along, across = robot.wheel_inertia_kg_m2, robot.wheel_inertia_kg_m2 * 0.55
    off = world.eccentric_m if side > 0 else 0.0
    return f"""
      <body name="{name}" pos="0 {side * robot.half_track_m * world.track} {r - robot.wheel_radius_m}">
        <joint name="{name}" type="hinge" axis="0 1 0" damping="{robot.viscous_friction_n_m_s}" frictionloss="{world.friction_n_m}"
               solreffriction="0.001 1" solimpfriction="0.9999 0.9999 0.001 0.5 2"/>
        <inertial pos="0 0 0" mass="{robot.wheel_mass_kg}" diaginertia="{across} {along} {across}"/>
        <geom name="{name}" type="ellipsoid" size="{r} {0.25 * r} {r}" pos="{off} 0 0"/>
      </body>"""


def casters(robot, world):
    """Frictionless balls before and behind the axle; none under a guided chassis, or a wheel that trails a vertical hinge there."""
    at, ball = CASTER_M
    up = ball - robot.wheel_radius_m
    if not world.guided:
        return "".join(
            f'<geom name="{n}" type="sphere" size="{ball}" pos="{x} 0 {up}"/>' for n, x in (("front", at), ("rear", -at))
        )
    if not world.swivel:
        return ""
    return f"""<body name="swivel" pos="{-at} 0 {up}">
          <joint name="spring" type="slide" axis="0 0 1" stiffness="4000" springref="{-SWIVEL_N / 4000}" damping="40"/>
          <joint name="swivel" type="hinge" axis="0 0 1" frictionloss="0.02" damping="0.001"/>
          <inertial pos="0 0 0" mass="0.02" diaginertia="1e-5 1e-5 1e-5"/>
          <body name="rear" pos="{-TRAIL_M} 0 0"><joint name="roll" type="hinge" axis="0 1 0" damping="0.0002"/>
            <inertial pos="0 0 0" mass="{SWIVEL_KG - 0.02}" diaginertia="1e-5 2e-5 1e-5"/>
            <geom name="rear" type="ellipsoid" size="{ball} {0.4 * ball} {ball}"/></body></body>"""


def floor_contacts(world):
    """Pairs of the floor with wheels and casters."""
    slide = f'condim="3" friction="{world.grip} {world.grip}" solreffriction="{world.slide_s} 1" {ROLLING}'
    pairs = "".join(f'<pair name="{n}" geom1="floor" geom2="{n}" {slide}/>' for n in ("left", "right"))
    if not world.guided:
        return pairs + "".join(f'<pair geom1="floor" geom2="{n}" condim="1" {SUPPORT}/>' for n in ("front", "rear"))
    if world.swivel:
        pairs += f'<pair geom1="floor" geom2="rear" condim="3" friction="0.8 0.8" {SUPPORT}/>'
    return pairs


def load(world):
    """The load above the axle: fixed, on springs, or held by a weld (then a body of the floor's world)."""
    if not world.load_kg:
        return "", "", ""
    j = world.load_inertia_kg_m2
    inertial = f'<inertial pos="0 0 0" mass="{world.load_kg}" diaginertia="{j} {j} {j}"/>'
    joints = ""
    if world.load_spring:
        hz, ratio = world.load_spring
        k, c = world.load_kg * (2 * np.pi * hz) ** 2, 2 * ratio * world.load_kg * 2 * np.pi * hz
        joints = "".join(f'<joint type="slide" axis="{a}" stiffness="{k}" damping="{c}"/>' for a in ("1 0 0", "0 1 0"))
    body = f'<body name="load" pos="{world.load_ahead_m} 0 {LOAD_HEIGHT_M}">{joints}{inertial}</body>'
    if world.load_falls_s is None:
        return body, "", ""
    free = f'<body name="load" pos="{world.load_ahead_m} 0 {world.extra["axle_m"] + LOAD_HEIGHT_M}"><freejoint/>{inertial}</body>'
    weld = f'<weld name="strap" body1="chassis" body2="load" {RIGID}/>'
    return "", free, weld


def cables(world):
    """Thin cables over the floor, laid at random: geoms and their pairs with the wheels."""
    draw, geoms, pairs = np.random.default_rng(5), "", ""
    for i in range(world.cables):
        x, y = draw.uniform(-5, 5, 2)
        turn = draw.uniform(0, 180)
        geoms += f'<geom name="cable{i}" type="capsule" size="{world.cable_m} 1.5" pos="{x} {y} 0" zaxis="{np.cos(turn)} {np.sin(turn)} 0"/>'
        pairs += "".join(f'<pair geom1="cable{i}" geom2="{w}" condim="3" friction="1 1" {ROLLING}/>' for w in ("left", "right"))
    return geoms, pairs


def mjcf(robot, world):
    """The model as an MJCF string."""
    world = replace(world, extra={**world.extra, "axle_m": robot.wheel_radius_m})
    mass, x, yaw = chassis_inertial(robot, world)
    riding, lying, weld = load(world)
    bumps, bump_pairs = cables(world)
    a, psi = world.slope_rad, world.uphill_rad
    gravity = -GRAVITY_M_S2 * np.array([np.sin(a) * np.cos(psi), np.sin(a) * np.sin(psi), np.cos(a)])
    limit = f'forcelimited="true" forcerange="{-world.torque_limit_n_m} {world.torque_limit_n_m}"' if world.torque_limit_n_m else ""
    lag = f'dyntype="filterexact" dynprm="{world.motor_lag_s}"' if world.motor_lag_s else ""
    motors = "".join(
        f'<general name="{n}" joint="{n}" gear="{g}" {lag} {limit}/>' for n, g in zip(("left", "right"), world.gain, strict=True)
    )
    return f"""
<mujoco>
  <compiler angle="radian" autolimits="false"/>
  <option timestep="{ENGINE_STEP_S}" integrator="implicitfast" cone="elliptic" impratio="{world.stiffness}" solver="Newton"
          tolerance="1e-12" gravity="{gravity[0]} {gravity[1]} {gravity[2]}"/>
  <default><geom contype="0" conaffinity="0" mass="0"/></default>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 1"/>{bumps}
    <body name="chassis" pos="0 0 {robot.wheel_radius_m - 1e-7}">
      {GUIDED if world.guided else FREE}
      <inertial pos="{x} 0 0.02" mass="{mass}" diaginertia="{0.6 * yaw} {0.8 * yaw} {yaw}"/>
      {casters(robot, world)}
      {wheel("left", 1, robot, world)}{wheel("right", -1, robot, world)}
      {riding}
    </body>
    {lying}
  </worldbody>
  <contact>
    {floor_contacts(world)}{bump_pairs}
  </contact>
  <equality>{weld}</equality>
  <actuator>{motors}</actuator>
</mujoco>"""


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
