"""The cases: what is so in each world that the nominal simulator lacks, and what an answer should say."""

from dataclasses import dataclass, field

from drives import ROW_S, Course
from hooks import AirDrag, LetGo, Rub, Sag, Tyre
from sensors import Sensors
from worlds import GRAVITY_M_S2, Robot, World

BASE = Robot()
SMALL = Robot(5.0, 0.055, 0.11, 0.042, 0.15, 0.0015, 0.0003)
LARGE = Robot(25.0, 1.1, 0.26, 0.1, 1.3, 0.012, 0.004)
HARD = Course(acceleration_m_s2=2.0, yaw_acceleration_rad_s2=8.0)
CREEP = 8.7e-4  # how far a force makes a contact creep: m/s per N, per second of `slide_s`, at a stiffness of 1 (measured)


@dataclass(frozen=True)
class Case:
    """One unit in one world: two drives, and the truth about them."""

    name: str
    kind: str  # none, single, pair, unlisted
    truth: dict = field(default_factory=dict)  # effect to {parameter: value}
    world: World = World()
    sensors: Sensors = Sensors()
    robot: Robot = BASE
    believed: World = World()  # what the nominal simulator holds
    course: Course = Course()
    without: tuple = ()  # columns the log lacks: torque, gyro, pose
    alike: tuple = ()  # effects that this log truly cannot tell from the truth: a class with both counts as right
    acts_as: tuple = ()  # listed effects that an unlisted one acts as, by their definition: said in the table, not counted
    note: str = ""


def none_cases():
    plain = [Case(f"none-{i}", "none", robot=r) for i, r in enumerate([BASE] * 5 + [SMALL] * 2 + [LARGE] * 2)]
    white = World(noise_within_row=True)
    return plain + [
        Case("none-white-torque", "none", world=white, note="torque noise white within a row"),
        Case("none-hard", "none", course=HARD),
        Case("none-no-torque", "none", without=("torque",)),
        Case("none-no-pose", "none", without=("pose",)),
        Case("none-guided", "none", world=World(guided=True), note="chassis without casters, as in worlds of uneven ways"),
    ]


def one(name, effect, parameters, **rest):
    return Case(name, "single", {effect: parameters}, **rest)


def body_cases():
    """Effects of bodies, joints and contacts."""
    gain = lambda rho: (2 / (2 + rho), 2 * (1 + rho) / (2 + rho))  # left, right with mean 1 and ratio 1 + rho
    mismatch = lambda rho: World(radius=gain(rho))
    resist = lambda c, r: World(friction_n_m=c * r.mass_kg * GRAVITY_M_S2 * r.wheel_radius_m / 2)
    skid = "vehicle.track_width", "gyro.scale_factor", "wheel.radius_scale"
    return [
        one("radius-both", "wheel.radius_scale", {"relative": 0.015}, world=World(radius=(1.015, 1.015))),
        one("radius-both-large", "wheel.radius_scale", {"relative": -0.025}, world=World(radius=(0.975, 0.975)), robot=LARGE),
        one("radius-left", "wheel.radius_left", {"relative": -0.02}, world=World(radius=(0.98, 1.0))),
        one("radius-right", "wheel.radius_right", {"relative": 0.015}, world=World(radius=(1.0, 1.015)), robot=SMALL),
        one("radius-mismatch", "wheel.radius_mismatch", {"right_over_left_minus_one": 0.01}, world=mismatch(0.01)),
        one("radius-mismatch-no-torque", "wheel.radius_mismatch", {"right_over_left_minus_one": -0.02}, world=mismatch(-0.02),
            without=("torque",)),
        one("radius-left-no-pose", "wheel.radius_left", {"relative": 0.02}, world=World(radius=(1.02, 1.0)), without=("pose",),
            alike=("wheel.radius_mismatch", "wheel.radius_right"), note="no pose: the mean radius is told by torques alone"),
        one("track", "vehicle.track_width", {"relative": 0.04}, world=World(track=1.04)),
        one("track-large", "vehicle.track_width", {"relative": -0.03}, world=World(track=0.97), robot=LARGE),
        one("track-wheels-and-gyro", "vehicle.track_width", {"relative": 0.05}, world=World(track=1.05), without=("pose", "torque"),
            alike=skid, note="wheels and gyro alone: track, radius and gain of the gyro are one"),
        one("payload", "vehicle.payload", {"mass_relative": 0.15, "inertia_relative": 0.02 / 0.21}, world=World(load_kg=1.8, load_inertia_kg_m2=0.02)),
        one("payload-small", "vehicle.payload", {"mass_relative": 0.3, "inertia_relative": 0.01 / 0.055}, world=World(load_kg=1.5, load_inertia_kg_m2=0.01), robot=SMALL),
        one("com-ahead", "vehicle.com_offset", {"offset_m": 0.03}, world=World(com_ahead_m=0.03)),
        one("com-behind", "vehicle.com_offset", {"offset_m": -0.04}, world=World(com_ahead_m=-0.04), robot=LARGE),
        one("rolling", "wheel.rolling_resistance", {"coefficient": 0.015}, world=resist(0.015, BASE)),
        one("rolling-large", "wheel.rolling_resistance", {"coefficient": 0.03}, world=resist(0.03, LARGE), robot=LARGE),
        one("gain", "motor.torque_gain", {"right_over_left_minus_one": 0.04}, world=World(gain=gain(0.04))),
        one("gain-small", "motor.torque_gain", {"right_over_left_minus_one": -0.05}, world=World(gain=gain(-0.05)), robot=SMALL),
        one("slope", "ground.slope", {"slope_rad": 0.02, "uphill_heading_rad": 0.8}, world=World(slope_rad=0.02, uphill_rad=0.8)),
        one("slope-no-pose", "ground.slope", {"slope_rad": 0.012, "uphill_heading_rad": -2.0}, without=("pose",),
            world=World(slope_rad=0.012, uphill_rad=-2.0)),
        one("skid", "wheel.lateral_skid", {"lateral_slip_s": 0.0059}, world=World(slide_s=0.012)),
        one("skid-strong", "wheel.lateral_skid", {"lateral_slip_s": 0.0149}, world=World(slide_s=0.03)),
        one("slip-tyre-no-pose", "wheel.slip", {}, world=tyres(0.1), course=HARD, without=("pose",)),
    ]


def tyres(compliance):
    """A world whose tyres creep by `compliance` times force over load."""
    stiffness = 0.004
    hook = Tyre(compliance, BASE.mass_kg * GRAVITY_M_S2 / 2, BASE.wheel_radius_m, CREEP / stiffness)
    return World(stiffness=stiffness, hooks=(hook,))


def sensor_cases():
    """Effects of sensors, on what the engine's bodies do."""
    delays = [one(f"gyro-delay-{ms}ms", "sensor.gyro_delay", {"delay_s": ms / 1e3}, sensors=Sensors(gyro_delay_s=ms / 1e3))
              for ms in (6.1, 9.6, 10.1, 12, 16, 26, 45)]
    wheels = [one(f"wheel-delay-{ms}ms", "sensor.wheel_delay", {"delay_s": ms / 1e3}, sensors=Sensors(wheel_delay_s=ms / 1e3))
              for ms in (7.4, 15, 40)]
    poses = [one(f"pose-delay-{ms}ms", "sensor.pose_delay", {"delay_s": ms / 1e3}, sensors=Sensors(pose_delay_s=ms / 1e3))
             for ms in (30, 75, 150)]
    level = lambda name, effect, ratio, s: one(name, effect, {"noise_over_nominal": ratio}, sensors=s)
    return [
        one("gyro-scale", "gyro.scale_factor", {"relative": 0.01}, sensors=Sensors(scale=0.01)),
        one("gyro-scale-small", "gyro.scale_factor", {"relative": -0.006}, sensors=Sensors(scale=-0.006), robot=SMALL),
        one("gyro-scale-no-torque", "gyro.scale_factor", {"relative": 0.02}, sensors=Sensors(scale=0.02), without=("torque",)),
        one("gyro-asymmetry", "gyro.scale_asymmetry", {"relative": 0.015}, sensors=Sensors(asymmetry=0.015)),
        *delays, *wheels, *poses,
        one("gyro-step", "gyro.bias_step", {"step_rad_s": 0.004}, sensors=Sensors(step_rad_s=0.004)),
        one("gyro-rectification", "gyro.vibration_rectification", {"coefficient_rad_s_per_m2_s2": 0.01}, sensors=Sensors(rectification=0.01)),
        one("lattice", "encoder.quantization", {"lsb_rad_s": 0.15}, sensors=Sensors(lattice_rad_s=0.15)),
        one("missed-bursts", "encoder.missed_ticks", {"loss_fraction": 0.3}, sensors=Sensors(bursts=(0.3, 0.5, 0.08))),
        one("missed-bursts-no-pose", "encoder.missed_ticks", {"loss_fraction": 0.5}, sensors=Sensors(bursts=(0.5, 0.3, 0.05)), without=("pose",)),
        one("missed-single", "encoder.missed_ticks", {"loss_fraction": 0.024}, sensors=Sensors(single_losses=(0.024, 4096)),
            note="each tick by itself, as much in the mean as missed-bursts: noise that grows with speed beside it"),
        one("missed-single-fine", "encoder.missed_ticks", {"loss_fraction": 0.02}, sensors=Sensors(single_losses=(0.02, 65536)),
            alike=("wheel.radius_right",), note="fine ticks: all but a mean loss"),
        level("noise-gyro-more", "gyro.noise_level", 2.0, Sensors(gyro_noise=2.0)),
        level("noise-gyro-less", "gyro.noise_level", 0.5, Sensors(gyro_noise=0.5)),
        level("noise-wheels-more", "encoder.noise_level", 1.6, Sensors(wheel_noise=1.6)),
        level("noise-wheels-less", "encoder.noise_level", 0.5, Sensors(wheel_noise=0.5)),
        level("noise-pose-more", "pose.noise_level", 2.5, Sensors(pose_noise=2.5)),
        level("noise-pose-less", "pose.noise_level", 0.5, Sensors(pose_noise=0.5)),
    ]


def pair_cases():
    two = lambda name, truth, **rest: Case(name, "pair", truth, **rest)
    skid = {"wheel.slip": {}, "wheel.lateral_skid": {}}
    return [
        two("slip-tyre", skid, world=tyres(0.1), note="a contact that creeps along creeps sideways too"),
        two("slip-viscous", skid, world=World(slide_s=0.003, stiffness=0.003), note="creep in proportion to force, whatever the speed: not the listed law"),
        two("slip-low-grip", skid, world=World(grip=0.12), course=HARD, note="Coulomb friction, wheels spin on"),
        two("ticks-counted", {"encoder.quantization": {"lsb_rad_s": 6.283185307 / 2048 / ROW_S}, "sensor.wheel_delay": {"delay_s": ROW_S / 2}},
            sensors=Sensors(ticks=2048), note="ticks counted over a row: a mean of that row, half a row late"),
        two("payload-and-scale", {"vehicle.payload": {"mass_relative": 0.2, "inertia_relative": 0.03 / 0.21}, "gyro.scale_factor": {"relative": 0.012}},
            world=World(load_kg=2.4, load_inertia_kg_m2=0.03), sensors=Sensors(scale=0.012)),
        two("radius-left-and-com", {"wheel.radius_left": {"relative": 0.015}, "vehicle.com_offset": {"offset_m": -0.03}},
            world=World(radius=(1.015, 1.0), com_ahead_m=-0.03)),
        two("load-ahead", {"vehicle.payload": {"mass_relative": 0.25}, "vehicle.com_offset": {"offset_m": 0.024}},
            world=World(load_kg=3.0, load_inertia_kg_m2=0.02, load_ahead_m=0.12), note="one load, ahead of the axle: both effects"),
    ]


def unlisted_cases():
    odd = lambda name, **rest: Case(name, "unlisted", **rest)
    length_s = Course().length_s
    return [
        odd("motor-saturates", world=World(torque_limit_n_m=0.45)),
        odd("motor-saturates-much", world=World(torque_limit_n_m=0.3), note="half of what is asked for: the controller winds up"),
        odd("battery-sags", world=World(hooks=(Sag(0.7, length_s),))),
        odd("wheel-eccentric", world=World(guided=True, eccentric_m=0.0015)),
        odd("air-drag", world=World(hooks=(AirDrag(6.0),)), acts_as=("wheel.rolling_resistance",)),
        odd("load-falls", world=World(load_kg=3.0, load_inertia_kg_m2=0.02, load_falls_s=0.5 * length_s, hooks=(LetGo(0.5 * length_s),))),
        odd("load-swings", world=World(load_kg=3.0, load_inertia_kg_m2=0.02, load_spring=(2.0, 0.1)),
            believed=World(load_kg=3.0, load_inertia_kg_m2=0.02), note="the team knows the load, and takes it for rigid"),
        odd("swivel-kicks", world=World(guided=True, swivel=True)),
        odd("wheels-low-pass", sensors=Sensors(wheel_low_pass_s=0.04), acts_as=("sensor.wheel_delay",)),
        odd("gyro-feels-acceleration", sensors=Sensors(acceleration=0.02)),
        odd("gyro-saturates", sensors=Sensors(gyro_limit_rad_s=1.0)),
        odd("cables-on-floor", world=World(guided=True, cables=60)),
        odd("motor-lags", world=World(motor_lag_s=0.05)),
        odd("wheel-rubs", world=World(hooks=(Rub(0.15, 1.0),)), acts_as=("wheel.rolling_resistance",)),
    ]


def all_cases():
    return none_cases() + body_cases() + sensor_cases() + pair_cases() + unlisted_cases()
