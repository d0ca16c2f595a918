"""Sealed cases of any simulator: what it said, and what a "real" robot did whose effect only the sealed labels tell."""

import argparse
import json
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from drives import Course, drive
from folders import seal, sim_toml, write_log
from sensors import Sensors, columns

NONE, UNLISTED = 0.2, 0.2  # shares of the cases


@dataclass(frozen=True)
class Case:
    """What the real robot has and the simulator lacks."""

    effects: dict = field(default_factory=dict)  # effect to {parameter: value}; ids that begin with x. are in no list
    world: dict = field(default_factory=dict)  # settings of the simulator's world
    sensors: Sensors = Sensors()


def either(draw, low, high):
    """A size of either sign, even in its logarithm."""
    return float(np.exp(draw.uniform(np.log(low), np.log(high))) * draw.choice([-1.0, 1.0]))


def size(draw, low, high):
    return abs(either(draw, low, high))


def sides(rho):
    """Left and right with a mean of one, of right over left less one."""
    return 2 / (2 + rho), 2 * (1 + rho) / (2 + rho)


def ratio(draw, low, high):
    """Right over left less one, and left and right with a mean of one."""
    rho = either(draw, low, high)
    return rho, sides(rho)


def radius(effect, shares):
    """Radii off nominal by a share of `shares`, left and right."""
    def one(draw):
        s = either(draw, 0.003, 0.03)
        return Case({effect: {"relative": s}}, {"radius": tuple(1 + s * side for side in shares)})

    return one


def mismatch(draw):
    rho, radii = ratio(draw, 0.003, 0.03)
    return Case({"wheel.radius_mismatch": {"right_over_left_minus_one": rho}}, {"radius": radii})


def track(draw):
    s = either(draw, 0.005, 0.08)
    return Case({"vehicle.track_width": {"relative": s}}, {"track": 1 + s})


def odd(name, world):
    """An effect that is in no list; `world` draws its settings."""
    return lambda draw: Case({f"x.{name}": {}}, world(draw))


def noise(draw):
    """A level over nominal, smaller or larger."""
    return float(draw.uniform(0.5, 0.85) if draw.uniform() < 0.5 else draw.uniform(1.15, 2.5))


def sensed(effect, parameter, setting, value):
    return Case({effect: {parameter: value}}, sensors=Sensors(**{setting: value}))


GEOMETRY = (  # of the wheels; a simulator's world has "radius" (left, right) and "track" over nominal
    radius("wheel.radius_scale", (1, 1)), radius("wheel.radius_left", (1, 0)), radius("wheel.radius_right", (0, 1)), mismatch, track,
)
SENSED = (  # effects of the sensors: drawn alike for every engine
    lambda d: sensed("gyro.scale_factor", "relative", "scale", either(d, 0.002, 0.03)),
    lambda d: sensed("gyro.scale_asymmetry", "relative", "asymmetry", either(d, 0.005, 0.04)),
    lambda d: sensed("gyro.vibration_rectification", "coefficient_rad_s_per_m2_s2", "rectification", either(d, 0.002, 0.02)),
    lambda d: sensed("gyro.bias_step", "step_rad_s", "step_rad_s", either(d, 0.001, 0.01)),
    lambda d: sensed("sensor.gyro_delay", "delay_s", "gyro_delay_s", size(d, 0.005, 0.05)),
    lambda d: sensed("sensor.wheel_delay", "delay_s", "wheel_delay_s", size(d, 0.005, 0.05)),
    lambda d: sensed("sensor.pose_delay", "delay_s", "pose_delay_s", size(d, 0.02, 0.15)),
    lambda d: sensed("gyro.noise_level", "noise_over_nominal", "gyro_noise", noise(d)),
    lambda d: sensed("encoder.noise_level", "noise_over_nominal", "wheel_noise", noise(d)),
    lambda d: sensed("pose.noise_level", "noise_over_nominal", "pose_noise", noise(d)),
    lambda d: sensed("encoder.quantization", "lsb_rad_s", "lattice_rad_s", size(d, 0.08, 0.3)),
)
SENSED_UNLISTED = (
    lambda d: Case({"x.gyro_feels_acceleration": {}}, sensors=Sensors(acceleration=either(d, 0.005, 0.03))),
    lambda d: Case({"x.gyro_saturates": {}}, sensors=Sensors(gyro_limit_rad_s=float(d.uniform(0.7, 1.1)))),
)


def plan(count, draw, listed, unlisted):
    """Cases in random order; each effect comes as often as the others, or once more."""
    nones, odd = max(1, round(NONE * count)), max(1, round(UNLISTED * count))

    def drawn(makers, number):
        order = [i for _ in range(number // len(makers) + 1) for i in draw.permutation(len(makers))]
        return [makers[i](draw) for i in order[:number]]

    cases = [Case()] * nones + drawn(unlisted, odd) + drawn(listed, max(0, count - nones - odd))
    return [cases[i] for i in draw.permutation(len(cases))]


CHANNELS = {  # where an effect shows, else by the first word of its id
    "gyro": "gyro", "encoder": "wheels", "pose": "pose", "wheel": "wheels", "vehicle": "torque", "motor": "torque", "ground": "torque",
    "wheel.rolling_resistance": "torque", "vehicle.track_width": "wheels",
    "sensor.gyro_delay": "gyro", "sensor.wheel_delay": "wheels", "sensor.pose_delay": "pose",
}


def label(case, folder, gyroid):
    """As `gyroid gap bench` keeps it, with the world's settings beside.

    Nats: what the true effect gains on fit.parquet when just it is fitted on the simulator's true sizes. An effect that
    gyroid refuses to fit has none and counts as strong: that it cannot be told is then gyroid's fault.
    """
    listed = [effect for effect in case.effects if not effect.startswith("x.")]
    nats = {}
    if listed and gyroid:
        command = [gyroid, "gap", "explain", folder / "sim.toml", "--fit", folder / "fit.parquet", "--effect", *listed, "--json", "-", "-q"]
        told = subprocess.run(command, check=False, capture_output=True).stdout
        nats = {effect["id"]: max(0.0, effect["gain_nats"]) for effect in (json.loads(told)["effects"] if told else ())}
    weakest = min(nats.values(), default=np.inf)
    strength = "none" if not case.effects else "weak" if weakest < 12 else "medium" if weakest < 100 else "strong"
    where = {effect: {"channel": CHANNELS.get(effect) or CHANNELS[effect.split(".")[0]]} for effect in listed}
    return {"kind": "driving", "background": [], "effects": case.effects, "nats": nats, "strength": strength, "where": where,
            "world": {k: repr(v) for k, v in case.world.items()}}


def make(engine, out, count, key_file, seed, length_s, gyroid=None):
    """Writes a folder a case: inputs.csv and sim.parquet, what the simulator said; fit.parquet and hold.parquet, what the
    robot did; sim.toml, the simulator's true sizes as a configuration. Returns the commitment to the labels.

    engine: has name, model, run_py, nominal, unit, steering, inputs (their columns), noise_per_root_hz, torque_noise_n_m_sqrt_s,
        without (columns that its logs lack), limits (of its drives, as Course's), listed, unlisted, body(world), controller(draw)
    """
    out.mkdir(parents=True)
    if out.resolve() in key_file.resolve().parents:
        raise SystemExit(f"{key_file} lies in {out}: keep the key elsewhere")
    secret = int(np.random.SeedSequence().entropy % 2**63) if seed is None else seed
    cases = plan(count, np.random.default_rng(secret), engine.listed + GEOMETRY + SENSED, engine.unlisted + SENSED_UNLISTED)
    course = Course(length_s, **engine.limits)
    labels = {}
    for index, case in enumerate(cases):
        name = f"{engine.name}-{index:03}"
        folder = out / name
        folder.mkdir()
        (folder / "sim.toml").write_text(sim_toml(engine.nominal | {"torque_noise_n_m_sqrt_s": engine.torque_noise_n_m_sqrt_s}, engine.unit, engine.steering))
        run = lambda world, way, part: drive(engine.body(world), engine.controller, engine.noise_per_root_hz, course,
                                             [secret, index, part], way=[secret, index, way])
        for part, log in enumerate(("fit", "hold")):
            made = columns(run(case.world, part, part), case.sensors, [secret, index, part], engine.without, engine.unit)
            write_log(folder / f"{log}.parquet", made)
        driven = columns(run({}, 0, 2), Sensors(), [secret, index, 2], unit=engine.unit)  # the course of fit.parquet, in the simulator
        write_log(folder / "inputs.csv", {name: driven[name] for name in ("t_s", *engine.inputs)})
        simulate(engine, folder / "inputs.csv", folder / "sim.parquet", seed=index + 1)
        labels[name] = label(case, folder, gyroid)
        print(f"{name} made", file=sys.stderr, flush=True)
    return seal(out, key_file, labels, secret)


def simulate(engine, inputs, log, model=None, seed=1):
    """Runs the team's simulator."""
    command = [sys.executable, engine.run_py, "--model", model or engine.model, "--inputs", inputs, "--out", log, "--seed", str(seed)]
    subprocess.run([str(word) for word in command], check=True, capture_output=True)


def main(engine, doc):
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="a new folder")
    parser.add_argument("--cases", type=int, default=engine.cases)
    parser.add_argument("--key", type=Path, required=True, help="file that the key to the labels is written to; outside --out")
    parser.add_argument("--length", type=float, default=90.0, metavar="S", help="length of a drive")
    parser.add_argument("--gyroid", help="the program: states in the labels how clearly each effect shows")
    parser.add_argument("--seed", type=int, help="whoever knows it can make the labels again; default: random")
    options = parser.parse_args()
    print(json.dumps({"commitment": make(engine, options.out, options.cases, options.key, options.seed, options.length, options.gyroid)}))
