#!/usr/bin/env python3
"""Reads every export back with the target's own parser, where PyPI or Debian has one.

    cargo build
    pip install numpy pyyaml opencv-python-headless pymavlink gtsam lxml
    apt-get install libsdformat-dev sdformat-sdf octave gcc-arm-none-eabi        # each is optional: what is missing is said and skipped
    python3 tests/exports/check.py [--drawn N] [--may-skip CHECK... --] [target/debug/gyroid]

With `--may-skip` only these checks may be skipped. With `--drawn` all is repeated for N configurations with numbers at random.
The numbers are held against those of full.toml by the equations of the targets' sources, not by ours.
"""
import argparse
import ast
import importlib.util
import json
import math
import os
import pathlib
import random
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import types

HERE = pathlib.Path(__file__).resolve().parent
CONFIGS = HERE
N, K, F = 1.7e-4, 2.0e-5, 200.0
C1, C2, T = -2.4e-3, 8.0e-3, 240.0
SIGMA, TAU = 6.0e-5, 1800.0
DEG = 180.0 / math.pi

skipped = {}


def draw(seed, folder):
    """Writes both configurations to `folder` with other numbers, up to 30 times as large or small, C1 and C2 of either sign."""
    global CONFIGS, N, K, F, C1, C2, T, SIGMA, TAU
    numbers = random.Random(seed)
    c1, c2, t, n, k, sigma, tau, step = (30.0 ** numbers.uniform(-1, 1) for _ in range(8))
    c1, c2 = c1 * numbers.choice((1, -1)), c2 * numbers.choice((1, -1))
    factors = {
        "gyro": {"c1_rad_s": c1, "c2_rad_s": c2, "time_constant_s": t, "angle_random_walk_rad_sqrt_s": n},
        "gyro.noise": {"rate_random_walk_rad_s_sqrt_s": k},
        "gyro.noise.terms.angle_random_walk_rad_sqrt_s": dict.fromkeys(("estimate", "std", "ci95"), n),
        "gyro.noise.terms.rate_random_walk_rad_s_sqrt_s": dict.fromkeys(("estimate", "std", "ci95"), k),
        "gyro.noise.terms.gauss_markov_rad_s": {**dict.fromkeys(("estimate", "std", "ci95"), sigma),
                                                **dict.fromkeys(("correlation_time_s", "correlation_time_ci95_s"), tau)},
        "validation": {"time_constant_ci95_s": t},
        "": {"sample_time_s": step},
    }

    def other(path):
        section = ""
        for line in path.read_text().splitlines():
            section = line.strip("[]") if line.startswith("[") else section
            key, _, value = line.partition(" = ")
            factor = factors.get(section, {}).get(key)
            yield line if factor is None else f"{key} = {re.sub('[-0-9.e]+', lambda x: repr(float(x[0]) * factor), value)}"

    for name in ("full.toml", "bare.toml"):
        (folder / name).write_text("\n".join(other(HERE / name)) + "\n")
    CONFIGS = folder
    N, K, F, C1, C2, T, SIGMA, TAU = 1.7e-4 * n, 2.0e-5 * k, 200.0 / step, -2.4e-3 * c1, 8.0e-3 * c2, 240.0 * t, 6.0e-5 * sigma, 1800.0 * tau


def close(found, wanted, what):
    assert math.isclose(found, wanted, rel_tol=1e-8, abs_tol=1e-300), f"{what}: {found!r} is not {wanted!r}"


def export(gyroid, target, folder, config="full.toml", *arguments):
    about = json.loads(subprocess.run([gyroid, "export", "--list", "--to", target, "--json", "-"],
                                      check=True, capture_output=True, text=True).stdout)["targets"][0]
    path = pathlib.Path(folder) / f"{target}-{pathlib.Path(config).stem}-{about['file']}"
    subprocess.run([gyroid, "export", CONFIGS / config, "--to", target, "-o", path, "--quiet", "--device-id", "3407882",
                    *arguments], check=True)
    return path


def module(path, stubs=()):
    """Imports a Python file, with stand-ins for packages that are not installed."""
    for name, stub in stubs:
        sys.modules[name] = stub
    spec = importlib.util.spec_from_file_location("exported", path)
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    return loaded


def wants(package):
    if importlib.util.find_spec(package) is None:
        raise ModuleNotFoundError(f"no {package}")


# --- YAML as PyYAML reads it: Kalibr (kalibr_common/ConfigReader.py uses yaml.safe_load) and ROS 1
def kalibr(gyroid, folder):
    wants("yaml")
    import yaml

    def statistics(data):
        """ImuParameters.getGyroStatistics."""
        assert data["update_rate"] > 0.0 and isinstance(data["rostopic"], str)
        assert data["gyroscope_noise_density"] > 0.0 and data["gyroscope_random_walk"] > 0.0
        return data["gyroscope_noise_density"] / math.sqrt(1.0 / data["update_rate"]), data["gyroscope_random_walk"]

    discrete, walk = statistics(yaml.safe_load(export(gyroid, "kalibr", folder).read_text()))
    close(discrete, N * math.sqrt(F), "discrete noise in Kalibr")
    close(walk, K, "random walk in Kalibr")
    try:
        statistics(yaml.safe_load(export(gyroid, "kalibr", folder, "bare.toml").read_text()))
    except KeyError as missing:
        assert "gyroscope_random_walk" in str(missing)
    else:
        raise AssertionError("a walk was invented")


def lio_sam(gyroid, folder):
    wants("yaml")
    import yaml

    one = yaml.safe_load(export(gyroid, "lio-sam", folder).read_text())["lio_sam"]
    two = yaml.safe_load(export(gyroid, "lio-sam-ros2", folder).read_text())["/**"]["ros__parameters"]
    for found in (one, two):
        assert found.keys() == {"imuGyrNoise", "imuGyrBiasN"}
        close(found["imuGyrNoise"], N, "imuGyrNoise")
        close(found["imuGyrBiasN"], K, "imuGyrBiasN")


def ros2(gyroid, folder):
    """ROS 2 distinguishes doubles from integers: PyYAML must see floats."""
    wants("yaml")
    import yaml

    data = yaml.safe_load(export(gyroid, "ros2-control", folder).read_text())
    covariance = data["imu_sensor_broadcaster"]["ros__parameters"]["static_covariance_angular_velocity"]
    assert len(covariance) == 9 and all(type(v) is float for v in covariance), covariance
    for i, value in enumerate(covariance):
        close(value, N * N * F if i % 4 == 0 else 0.0, f"covariance[{i}]")
    wheels = data["diff_drive_controller"]["ros__parameters"]
    assert wheels == {"wheel_separation": 0.34, "wheel_radius": 0.05}, wheels
    node = yaml.safe_load(export(gyroid, "robot-localization", folder).read_text())["ekf_filter_node"]["ros__parameters"]
    assert node["imu0_config"] == [i == 11 for i in range(15)] and node["imu0"] == "/imu/data", node


def kf_gins(gyroid, folder):
    """KF-GINS reads with yaml-cpp; loadConfig converts as below."""
    wants("yaml")
    import yaml

    data = yaml.safe_load(export(gyroid, "kf-gins", folder).read_text())
    noise = data["imunoise"]
    for v in noise["arw"]:
        close(v / DEG / 60.0, N, "arw")
    for v in noise["gbstd"]:
        close(v / DEG / 3600.0, SIGMA, "gbstd")
    close(noise["corrtime"] * 3600.0, TAU, "corrtime")
    close(data["initgyrbias"][2] / DEG / 3600.0, C1 + C2, "initgyrbias")


# --- YAML as OpenCV's FileStorage reads it
def opencv(gyroid, folder):
    wants("cv2")
    import cv2

    def storage(target):
        file = cv2.FileStorage(str(export(gyroid, target, folder)), cv2.FILE_STORAGE_READ)
        assert file.isOpened(), target
        return file

    def real(node, name):
        # ORB-SLAM3's Settings.cc stops where a number is no real
        found = node.getNode(name)
        assert found.isReal() and not found.isInt(), name
        return found.real()

    openvins = storage("openvins")  # its nodes live as long as it does
    imu = openvins.getNode("imu0")
    close(real(imu, "gyroscope_noise_density"), N, "noise density")
    close(real(imu, "gyroscope_random_walk"), K, "random walk")
    close(real(imu, "update_rate"), F, "rate")
    assert imu.getNode("rostopic").string() == "/imu/data"
    orb = storage("orb-slam3")
    # Tracking.cc: Calib(Tbc, Ng sf, Na sf, Ngw/sf, Naw/sf); ImuTypes.cc squares them a step
    sf = math.sqrt(real(orb, "IMU.Frequency"))
    close((real(orb, "IMU.NoiseGyro") * sf) ** 2 / F, N * N, "rotation of ORB-SLAM3 in a second")
    close((real(orb, "IMU.GyroWalk") / sf) ** 2 * F, K * K, "bias of ORB-SLAM3 in a second")
    vins = storage("vins-fusion")
    dt = 1.0 / F
    close(F * 2.0 * (0.5 * dt * real(vins, "gyr_n")) ** 2, N * N, "rotation of VINS in a second")
    close(F * (dt * real(vins, "gyr_w")) ** 2, K * K, "bias of VINS in a second")


# --- Python modules
def gtsam(gyroid, folder):
    wants("gtsam")
    import gtsam
    import numpy as np

    params = gtsam.PreintegrationCombinedParams.MakeSharedU(9.81)
    module(export(gyroid, "gtsam", folder)).set_gyro(params)
    assert np.allclose(params.getGyroscopeCovariance(), N * N * np.eye(3), rtol=1e-8, atol=0.0)
    assert np.allclose(params.getBiasOmegaCovariance(), K * K * np.eye(3), rtol=1e-8, atol=0.0)
    # what GTSAM makes of it: the covariance of a rotation preintegrated over ten seconds at rest
    params.setAccelerometerCovariance(1e-6 * np.eye(3))
    params.setIntegrationCovariance(1e-12 * np.eye(3))
    params.setBiasAccCovariance(1e-12 * np.eye(3))
    pim = gtsam.PreintegratedCombinedMeasurements(params)
    seconds, rate = 10, 200
    for _ in range(seconds * rate):
        pim.integrateMeasurement(np.array([0.0, 0.0, 9.81]), np.zeros(3), 1.0 / rate)
    covariance = pim.preintMeasCov()
    # N² t and the walk's K² t³/3 in the angle, K² t in the bias (order: rotation, position, velocity, biases)
    t = float(seconds)
    assert math.isclose(covariance[2, 2], N * N * t + K * K * t**3 / 3.0, rel_tol=5e-3), covariance[2, 2]
    assert math.isclose(covariance[14, 14], K * K * t, rel_tol=1e-6), covariance[14, 14]
    plain = gtsam.PreintegrationParams.MakeSharedU(9.81)
    module(export(gyroid, "gtsam", folder, "bare.toml")).set_gyro(plain)
    assert np.allclose(plain.getGyroscopeCovariance(), N * N * np.eye(3), rtol=1e-8, atol=0.0)


def gnss_ins_sim(gyroid, folder):
    wants("numpy")
    err = module(export(gyroid, "gnss-ins-sim", folder)).imu_err
    # IMU.__init__ of gnss_ins_sim/sim/imu_model.py
    close(err["gyro_arw"][2] / DEG / 60.0, N, "gyro_arw")
    close(err["gyro_b"][2] / DEG / 3600.0, C1 + C2, "gyro_b")
    close(err["gyro_b_stability"][2] / DEG / 3600.0, SIGMA, "gyro_b_stability")
    close(err["gyro_b_corr"][2], TAU, "gyro_b_corr")


def isaac_lab(gyroid, folder):
    """Stand-ins with the signatures of isaaclab.utils.noise: the package itself needs a GPU."""
    noise = types.ModuleType("isaaclab.utils.noise")

    class Cfg:
        def __init__(self, **arguments):
            self.__dict__.update(arguments)

    noise.GaussianNoiseCfg = type("GaussianNoiseCfg", (Cfg,), {})
    noise.NoiseModelCfg = type("NoiseModelCfg", (Cfg,), {})
    noise.NoiseModelWithAdditiveBiasCfg = type("NoiseModelWithAdditiveBiasCfg", (Cfg,), {})
    stubs = [("isaaclab", types.ModuleType("isaaclab")), ("isaaclab.utils", types.ModuleType("isaaclab.utils")),
             ("isaaclab.utils.noise", noise)]
    path = export(gyroid, "isaac-lab", folder)
    ast.parse(path.read_text())
    cfg = module(path, stubs).GYRO_NOISE
    close(cfg.noise_cfg.std, N * math.sqrt(F), "noise of an observation")
    close(cfg.bias_noise_cfg.std, 3.0e-4, "bias of an episode")
    assert cfg.noise_cfg.operation == "add" and cfg.bias_noise_cfg.operation == "abs"
    bare = module(export(gyroid, "isaac-lab", folder, "bare.toml"), stubs).GYRO_NOISE
    assert type(bare).__name__ == "NoiseModelCfg"


# --- parameters
def ardupilot(gyroid, folder):
    wants("pymavlink")
    from pymavlink import mavparm

    values = mavparm.MAVParmDict()
    assert values.load(str(export(gyroid, "ardupilot", folder)))
    dt = 0.012
    close((dt * values["EK3_GYRO_P_NSE"]) ** 2 / dt, N * N, "EK3_GYRO_P_NSE")
    close((dt * dt * values["EK3_GBIAS_P_NSE"]) ** 2 / dt**3, K * K, "EK3_GBIAS_P_NSE")
    close(values["INS_TCAL1_GYR1_Z"], -58.0, "slope at 35 degC")
    close(values["INS_TCAL1_GYR2_Z"], 2.0, "bend")
    assert len(values) == 8 and all(len(name) <= 16 for name in values), sorted(values)


def px4(gyroid, folder):
    """QGroundControl's loadFromStream: five cells by tabs, comments begin with #; PX4 keeps single precision."""

    def single(v):
        return struct.unpack("f", struct.pack("f", v))[0]

    rows = {}
    for line in export(gyroid, "px4", folder).read_text().splitlines():
        if line.startswith("#") or not line:
            continue
        vehicle, component, name, value, kind = line.split("\t")
        assert (vehicle, component) == ("1", "1") and len(name) <= 16, line
        rows[name] = int(value) if kind == "6" else single(float(value))
        assert kind in ("6", "9"), line
    dt = 0.01
    assert math.isclose((dt * rows["EKF2_GYR_NOISE"]) ** 2 / dt, N * N, rel_tol=1e-6)
    assert math.isclose((dt * rows["EKF2_GYR_B_NOISE"]) ** 2 / dt, K * K, rel_tol=1e-6)
    assert rows["TC_G_ENABLE"] == 1 and rows["TC_G0_ID"] == 3407882
    for t in (12.0, 30.0, 41.0):
        d = t - rows["TC_G0_TREF"]
        offset = rows["TC_G0_X0_2"] + rows["TC_G0_X1_2"] * d + rows["TC_G0_X2_2"] * d * d + rows["TC_G0_X3_2"] * d**3
        z = t - 12.0
        assert math.isclose(offset, C2 - 1.5e-4 * z + 2.0e-6 * z * z, rel_tol=1e-5), t


# --- XML
def sdf_schema(gyroid, folder):
    """The schema of <noise> that comes with libsdformat (Debian: sdformat-sdf); SDF_SCHEMA names another folder.

    As a whole that schema is not valid (it declares elements twice, and Debian leaves parts out).
    """
    wants("lxml")
    from lxml import etree

    schema = pathlib.Path(os.environ.get("SDF_SCHEMA", "/usr/share/sdformat12/1.9")) / "noise.xsd"
    if not schema.exists():
        raise ModuleNotFoundError("no sdformat-sdf")
    text = re.sub(r"<xsd:include[^>]*types.xsd'/>", "", schema.read_text())
    validator = etree.XMLSchema(etree.fromstring(text.encode()))
    for config in ("full.toml", "bare.toml"):
        document = etree.parse(str(export(gyroid, "gazebo", folder, config)))
        noises = list(document.iter("noise"))
        assert len(noises) == 3
        for noise in noises:
            validator.assertValid(etree.ElementTree(noise))


def sdf_library(gyroid, folder):
    """libsdformat itself (Debian: libsdformat-dev), through sdf_noise.cc; SDF_NOISE names the program ready built."""
    program = os.environ.get("SDF_NOISE")
    if program is None:
        flags = subprocess.run(["pkg-config", "--cflags", "--libs", "sdformat12"], capture_output=True, text=True)
        if flags.returncode != 0:
            raise ModuleNotFoundError("no libsdformat-dev")
        program = str(pathlib.Path(folder) / "sdf_noise")
        subprocess.run(["g++", "-std=c++17", str(HERE / "sdf_noise.cc"), "-o", program, *flags.stdout.split()], check=True)
    printed = subprocess.run([program, export(gyroid, "gazebo", folder)], check=True, capture_output=True, text=True)
    assert not printed.stderr, printed.stderr
    noise = {name: float(value) for name, value in (line.split() for line in printed.stdout.splitlines())}
    assert noise["type"] == 2, "gaussian_quantized"
    close(noise["stddev"], N * math.sqrt(noise["update_rate"]), "stddev")
    tau, dt, bias = noise["dynamic_bias_correlation_time"], 1.0 / noise["update_rate"], noise["bias_mean"]
    for step in range(100_000):
        e = C1 * (1.0 - math.exp(-step * dt / T)) + C2
        assert abs(noise["mean"] + bias - e) < 1e-12, step
        bias *= math.exp(-dt / tau)
    close(noise["dynamic_bias_stddev"], K, "random walk")
    assert noise["precision"] == 5.0e-4


def rotors(gyroid, folder):
    import xml.etree.ElementTree as tree

    plugin = tree.parse(export(gyroid, "rotors", folder)).getroot()
    value = {child.tag: float(child.text) for child in plugin}
    tau = value["gyroscopeBiasCorrelationTime"]
    # gazebo_imu_plugin.cpp: stationary variance sigma_b_g² tau/2
    close(value["gyroscopeBiasRandomWalk"] * math.sqrt(tau / 2.0), SIGMA, "stationary bias")
    assert value["gyroscopeRandomWalk"] == value["gyroscopeBiasRandomWalk"]
    close(value["gyroscopeNoiseDensity"], N, "noise density")
    close(tau, TAU, "correlation time")
    assert value["gyroscopeTurnOnBiasSigma"] == 3.0e-4


# --- MATLAB's language, as Octave reads it, with a struct in the place of gyroparams
def matlab(gyroid, folder):
    octave = shutil.which("octave-cli") or shutil.which("octave")
    if octave is None:
        raise ModuleNotFoundError("no octave")
    path = export(gyroid, "matlab", folder)
    for known, scale in (("true", 1.0), ("false", math.sqrt(2.0))):
        driver = pathlib.Path(folder) / "driver.m"
        driver.write_text(
            "1;\nfunction p = gyroparams(), p = struct(); end\nfunction c = fractalcoef(n), c = n; end\n"
            f"function r = isprop(p, name), r = {known}; end\nsource('{path}');\n"
            "printf('%.17g\\n', params.NoiseDensity(3), params.RandomWalk(3), params.ConstantBias(3));\n")
        out = subprocess.run([octave, "--no-gui", "-q", driver], check=True, capture_output=True, text=True).stdout.split()
        density, walk, bias = map(float, out)
        # imuSensor: w sqrt(f/s) NoiseDensity and w sqrt(s/f) RandomWalk, s = 1 single-sided, 2 double-sided
        s = 1.0 if known == "true" else 2.0
        close(density * math.sqrt(F / s), N * math.sqrt(F), f"a sample with scale {scale}")
        close(walk * math.sqrt(s / F), K / math.sqrt(F), f"a step of the walk with scale {scale}")
        close(bias, C1 + C2, "ConstantBias")


# --- C11 for a microcontroller, compiled for one without its libraries, and all that it leaves undefined
def firmware(gyroid, folder):
    compiler = shutil.which("arm-none-eabi-gcc")
    if compiler is None:
        raise ModuleNotFoundError("no gcc-arm-none-eabi")
    header = export(gyroid, "c", folder)
    source, program = header.with_name("firmware.c"), header.with_name("firmware.o")
    source.write_text(
        f'#include "{header.name}"\n'
        "double corrected(gyro_bias *bias, double rate_rad_s) { return gyro_bias_correct(bias, rate_rad_s); }\n"
        "void lost(gyro_bias *bias, unsigned long samples) { gyro_bias_skip(bias, samples); }\n")
    for core in (["cortex-m0"], ["cortex-m7", "-mfpu=fpv5-d16", "-mfloat-abi=hard"]):
        subprocess.run([compiler, "-mthumb", f"-mcpu={core[0]}", *core[1:], "-std=c11", "-Wall", "-Wextra", "-Werror",
                        "-ffreestanding", "-O2", "-c", source, "-o", program], check=True)
        symbols = subprocess.run(["arm-none-eabi-nm", "-u", program], check=True, capture_output=True, text=True).stdout
        # a core without doubles calls the compiler's own, and nothing else
        assert all(name.startswith("__aeabi_") for name in symbols.split() if name != "U"), symbols


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("gyroid", nargs="?", default=str(HERE.parents[1] / "target/debug/gyroid"))
    parser.add_argument("--may-skip", nargs="*", metavar="CHECK", help="fail where another one is skipped")
    parser.add_argument("--drawn", type=int, default=0, metavar="N", help="repeat it for so many configurations drawn at random")
    arguments = parser.parse_args()
    checks = (kalibr, lio_sam, ros2, kf_gins, opencv, gtsam, gnss_ins_sim, isaac_lab, ardupilot, px4, sdf_schema,
              sdf_library, rotors, matlab, firmware)
    for seed in range(arguments.drawn + 1):
        with tempfile.TemporaryDirectory() as folder:
            if seed:
                draw(seed, pathlib.Path(folder))
            for check in checks:
                try:
                    check(arguments.gyroid, folder)
                except ModuleNotFoundError as missing:
                    skipped[check.__name__] = missing
                except Exception as error:
                    error.add_note(f"configuration {seed}: {[C1, C2, T, N, K, F, SIGMA, TAU]}")
                    raise
    checked = [check.__name__ for check in checks if check.__name__ not in skipped]
    print("read back:", ", ".join(checked))
    if skipped:
        print("skipped:", ", ".join(f"{name} ({missing})" for name, missing in skipped.items()))
    needed = [] if arguments.may_skip is None else [name for name in skipped if name not in arguments.may_skip]
    if needed:
        print("may not be skipped:", ", ".join(needed), file=sys.stderr)
    return int(bool(needed))


if __name__ == "__main__":
    sys.exit(main())
