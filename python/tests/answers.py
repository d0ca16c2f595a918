"""Answers of every command, on the data of the repository and on logs that lack something: what schemas and types are made from."""

from __future__ import annotations

import json
import subprocess
import sysconfig
import tempfile
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from drawn import of_drive, of_rest

DATA = Path(__file__).parents[2] / "data"
PROGRAM = Path(sysconfig.get_path("scripts")) / "gyroid"
Answer: TypeAlias = dict[str, Any]


def answers(drawn: bool) -> dict[str, dict[str, list[Answer]]]:
    """Answers by command and by kind: a command on several axes or logs has another kind than on one. `drawn`: also about logs drawn at
    random."""
    import gyroid

    power_on, robot, cold = DATA / "power_on.csv", DATA / "robot.toml", DATA / "cats_coldsoak_a.csv"
    rng = np.random.default_rng(1)
    t_s = np.arange(0.0, 1800.0, 0.5)
    temperature_c = 40 - 15 * np.exp(-t_s / 300)
    walk = 1e-5 * np.cumsum(rng.normal(size=t_s.size)) + 1e-3 * np.sin(2 * np.pi * 0.2 * t_s)
    warm = walk + 2e-5 * temperature_c + 2e-4 * rng.normal(size=t_s.size)
    white = 2e-4 * rng.normal(size=t_s.size)
    fits = [
        gyroid.fit(power_on, base=robot, latitude_deg=45.0),
        gyroid.fit(power_on, fix={"c2_rad_s": 0.0}, loss="huber"),
        gyroid.fit(cold),
        gyroid.fit(cold, weighting="walk"),
        gyroid.fit(t_s, warm, temperature_c),
        gyroid.fit(t_s, warm, temperature_c, against="temperature"),
        gyroid.fit(t_s, white),
        gyroid.fit(power_on, memory_mb=0),
    ]
    config = fits[0].config()
    noises = [
        gyroid.noise(power_on, datasheet="mpu6050", write=config),
        gyroid.noise(cold, draws=99),
        gyroid.noise(t_s, warm, temperature_c, draws=99),
        gyroid.noise(t_s, white, draws=99),
    ]
    checks = [gyroid.validate(config, power_on), gyroid.validate(fits[5].config(accept=True), cold)]
    square = gyroid.simulate(config, course="square", duration_s=60, start_offset_s=20)
    bare = {name: square.recording[name] for name in ("t_s", "gyro_z_rad_s", "wheel_left_rad_s", "wheel_right_rad_s")}
    drives = [
        gyroid.navigate(config, DATA / "drive.parquet", save_config=True),
        gyroid.navigate(config, square.recording, gate=0.9999),
        gyroid.navigate(config, bare, start_offset_s=20),
    ]
    loaded = gyroid.simulate(config, course="square", duration_s=60, start_offset_s=20, load_kg=2.0)
    rest = gyroid.simulate(config, duration_s=600, seed=3)
    late = np.roll(square.recording["gyro_z_rad_s"], 25)
    heavy = {**square.recording, "gyro_z_rad_s": 1.1 * late}
    standing = standing_simulator(config)
    shaken = {"t_s": t_s, "gyro_z_rad_s": warm}
    rover, rovers = DATA / "truth.toml", [DATA / "drives" / f"rover_{part}.parquet" for part in ("fit", "hold")]
    gaps = [
        gyroid.diagnose(rover, *rovers),
        gyroid.diagnose(rover, rovers, without=["wheel.radius_mismatch"]),
        gyroid.diagnose(config, heavy, square.recording),
        gyroid.diagnose(config, square.recording),
        gyroid.diagnose(config, [square.recording, loaded.recording], load_kg=[0.0, 2.0]),
        gyroid.diagnose(config, {**bare, "gyro_z_rad_s": 1.1 * bare["gyro_z_rad_s"]}, start_offset_s=20),
        gyroid.diagnose(standing, shaken, rest.recording),
        gyroid.diagnose(standing, rest.recording),
        gyroid.diagnose(standing, shaken, without=["gyro.tone", "gyro.rate_random_walk", "gyro.narrow_band_noise"]),
    ]
    compared = [gyroid.compare(square.recording, heavy, square.recording, paired=True), gyroid.compare(rest.recording, shaken)]
    explained = [
        gyroid.explain(config, heavy, ["gyro.scale_factor"]),
        gyroid.explain(standing, shaken, ["gyro.rate_random_walk", "gyro.tone"]),
    ]
    exports = [gyroid.export(config, to) for to in ("kalibr", "px4", "gazebo")]
    looks = [gyroid.inspect(power_on), gyroid.inspect(DATA / "drive.parquet")]
    studies = [gyroid.study(runs=2, duration_s=10, sweeps=True, convergence=2), gyroid.study(runs=2, rest=cold)]
    unfit = fits[5].config(accept=True)
    all_of: dict[str, dict[str, list[Any]]] = {
        "fit": {"Fit": fits},
        "noise": {"Noise": noises},
        "validate": {"Validate": checks},
        "navigate": {"Navigate": drives},
        "simulate": {"Simulate": [square, rest, loaded]},
        "gap.diagnose": {"GapDiagnose": gaps},
        "gap.compare": {"GapCompare": compared},
        "gap.explain": {"GapExplain": explained},
        "export": {"Export": exports, "ExportRefused": [gyroid.export(unfit, "kalibr")]},
        "inspect": {"Inspect": looks},
        "study": {"Study": studies},
    }
    made = {command: {kind: [r.to_dict() for r in of] for kind, of in kinds.items()} for command, kinds in all_of.items()}
    with tempfile.TemporaryDirectory() as folder:
        for command, kind, found in of_the_program(Path(folder), config.text):
            made.setdefault(command, {}).setdefault(kind, []).append(found)
        for command, kind, found in of_drawn_logs(Path(folder)) if drawn else []:
            made[command].setdefault(kind, []).append(found)
    # an axis of several is answered as one alone is
    for command in ("fit", "noise"):
        kind = command.capitalize()
        alone = [{key: value for key, value in one.items() if key != "schema"} for one in made[command][kind]]
        pooled = {"schema": f"gyroid.{command}/1", "axes": dict(enumerate(alone)), "fit_for_use": True}
        made[command][f"{kind}Axes"].append(pooled)
    return made


def of_the_program(folder: Path, config: str) -> list[tuple[str, str, Answer]]:
    """Answers that only the command line gives: command, kind, answer."""
    logs = folder / "logs"
    for new in (logs, folder / "man"):
        new.mkdir()
    for name, seed in (("a", 1), ("b", 2), ("c", 3)):
        run(folder, "simulate", DATA / "truth.toml", "--duration", "1200", "--sample-time", "0.5", "--seed", seed, "-o", logs / f"{name}.csv")
    (logs / "d.csv").write_text("t_s,gyro_z_rad_s\n0,1\n")
    (folder / "gyroid.toml").write_text(config)
    cold = DATA / "cats_coldsoak_a.csv"
    bench = [("--kind", kind, "--cases", cases, "--seed", 3, "--habits", 0) for kind, cases in (("stationary", 4), ("driving", 2))]
    drives = [DATA / "drives" / f"rover_{part}.parquet" for part in ("fit", "hold")]
    gap = (DATA / "truth.toml", "--fit", drives[0], "--hold", drives[1])
    rest = (DATA / "truth.toml").read_text().replace('"driving"', '"stationary"').replace("\nsample_time_s = 0.01", "\nsample_time_s = 1.0")
    (folder / "standing.toml").write_text(rest.replace("[gyro]\n", "[gyro]\nturn_on_bias_std_rad_s = 0.005\n"))
    run(folder, "simulate", "standing.toml", "--duration", 600, "-o", "standing.csv")
    power = ("--effect", "gyro.tone", "gyro.rate_ramp", "gyro.turn_on_shift", "gyro.supply_sensitivity", "--cases", 3, "--check", 2)
    wanders = ("--among", "gyro.rate_ramp", "gyro.rate_random_walk")
    among = ("--among", "vehicle.payload", "motor.torque_gain")
    gain = ("--among", "gyro.scale_factor", "vehicle.track_width")
    patch = ("--patch", DATA.parent / "examples" / "mujoco" / "robot.xml", "-o", "patched.xml")
    (folder / "late.toml").write_text((DATA / "truth.toml").read_text() + '\n[[effect]]\nid = "sensor.gyro_delay"\ndelay_s = 0.05\n')
    run(folder, "simulate", "late.toml", "--course", "random", "--duration", "60", "-o", "late.parquet")
    late = (DATA / "truth.toml", "--fit", "late.parquet", *patch[:-1], "late.xml")
    # without a pose gain, track and radius look alike, and the delay is found beside each
    (folder / "two.toml").write_text((folder / "late.toml").read_text() + '[[effect]]\nid = "gyro.scale_factor"\nrelative = 0.05\n')
    run(folder, "simulate", "two.toml", "--course", "random", "--duration", "20", "--seed", 3, "-o", "two.csv")
    rows = [line.split(",") for line in (folder / "two.csv").read_text().splitlines()]
    kept = [k for k, name in enumerate(rows[0]) if name.startswith(("t_s", "time_since", "gyro_", "wheel_"))]
    (folder / "blind.csv").write_text("".join(",".join(row[k] for k in kept) + "\n" for row in rows))
    fleet(folder / "fleet")
    many = ("--accept", "--draws", 99)
    run(folder, "fit", "fleet", *many, "--results", "fleet.parquet")
    run(folder, "fit", "fleet/robot_4", *many, "--results", "no_temperature.parquet")
    run(folder, "noise", logs, "--draws", 99, "--results", "noises.parquet")
    (folder / "robots").mkdir()
    for robot in (1, 2):
        run(folder, "simulate", "two.toml", "--course", "random", "--duration", "20", "--seed", robot, "-o", f"robots/{robot}.parquet")
    robots = ("gap", "fleet", DATA / "truth.toml", "robots", "--unit", "robots/(.)")
    lines = [
        ("gap.fleet", "GapFleet", (*robots, "--results", "robots.parquet")),
        ("merge", "MergeGapFleet", ("merge", "robots.parquet", "-o", "robots.csv", "--unit", "robots/(.)")),
        ("noise", "NoiseMany", ("noise", logs, "--draws", 99)),
        ("merge", "MergeNoise", ("merge", "noises.parquet", "-o", "noises.csv")),
        ("merge", "Merge", ("merge", "fleet.parquet", "-o", "merged.csv")),
        ("merge", "Merge", ("merge", "no_temperature.parquet", "-o", "no_temperature.csv")),
        ("merge", "Merge", ("merge", "fleet.parquet", "merged.csv", "-o", "again.csv", "--accept", "--config", "fleet.toml")),
        ("track", "Track", ("track", "fleet.parquet")),
        ("track", "Track", ("track", "fleet.parquet", "--unit", "robot_[0-3]", "--type", "robot_[01]", "--per-year", 20)),
        ("gap.diagnose", "GapDiagnose", ("gap", "diagnose", *gap, *patch)),
        ("gap.diagnose", "GapDiagnose", ("gap", "diagnose", *late)),
        ("inspect", "Inspect", ("inspect", logs / "d.csv")),
        ("fit", "FitMany", ("fit", logs, "--config", "many.toml")),
        ("fit", "FitAxes", ("fit", cold, "--axis", "all")),
        ("noise", "NoiseAxes", ("noise", cold, "--axis", "all")),
        ("export", "ExportList", ("export", "--list")),
        ("init", "Init", ("init", "--kind", "rest", "-o", "rest.toml")),
        ("init", "Init", ("init", "--kind", "driving", "-o", "driving.toml")),
        ("gap.twin", "GapTwin", ("gap", "twin", DATA / "drives" / "rover_hold.parquet", "-o", "twin.toml")),
        ("gap.power", "GapPower", ("gap", "power", "standing.toml", "--inputs", "standing.csv", *power)),
        ("gap.plan", "GapPlan", ("gap", "plan", "standing.toml", "--fit", "standing.csv", *wanders, "--experiment", "again")),
        ("gap.plan", "GapPlan", ("gap", "plan", DATA / "truth.toml", "--fit", "late.parquet", *among, "--experiment", "spins", "payload")),
        ("gap.plan", "GapPlan", ("gap", "plan", DATA / "truth.toml", "--fit", "blind.csv", "--experiment", "squares_marked")),
        ("gap.plan", "GapPlan", ("gap", "plan", DATA / "truth.toml", "--fit", "blind.csv", *gain, "--experiment", "spins_marked")),
        ("man", "Man", ("man", "-o", "man")),
        ("demo", "Demo", ("demo", "-o", "demo")),
    ]
    for i, options in enumerate(bench):
        lines += [
            ("gap.bench.make", "GapBenchMake", ("gap", "bench", "make", f"bench{i}", *options)),
            ("gap.bench.run", "GapBenchRun", ("gap", "bench", "run", f"bench{i}", "--answers", f"answers{i}")),
            ("gap.bench.score", "GapBenchScore", ("gap", "bench", "score", f"bench{i}", "--answers", f"answers{i}", "--key", f"bench{i}.key")),
        ]
    return [(command, kind, run(folder, *line)) for command, kind, line in lines]


#: Seeds of the logs from which answers are taken; the first thousand are left to the test.
SEEDS = range(1000, 1200)


def of_drawn_logs(folder: Path) -> list[tuple[str, str, Answer]]:
    """Answers about logs drawn at random: command, kind, answer."""
    found: list[tuple[str, str, Answer]] = []

    def ask(*line: object) -> bool:
        done = subprocess.run([PROGRAM, *map(str, line), "--json", "-"], capture_output=True, text=True, check=False)
        if done.returncode not in (0, 3):
            return False
        one: Answer = json.loads(done.stdout)
        command = one["schema"].removeprefix("gyroid.").partition("/")[0]
        kind = "".join(word.capitalize() for word in command.split("."))
        found.append((command, kind + "Axes" * ("axes" in one) + "Refused" * (command == "export" and done.returncode == 3), one))
        return True

    for draw in (of_rest, of_drive):
        for seed in SEEDS:
            with tempfile.TemporaryDirectory(dir=folder) as own:
                draw(seed, Path(own), ask)
    return found


def fleet(folder: Path) -> None:
    """Logs of four robots, five power-ons each, a day apart, of which the last one of one robot is off; of a fifth robot, whose clock has no
    date and whose last log shows no warm-up, as a middle one of the first shows none; and of a sixth that was switched on once and does not belong to them."""
    rng = np.random.default_rng(2)
    t_s = np.arange(0.0, 300.0, 0.5)

    def write(robot: int, day: int, begin_s: float, c1: float, c2: float) -> None:
        rate = c2 + c1 * (1 - np.exp(-t_s / 40)) + 3e-4 * rng.normal(size=t_s.size)
        # the clock without a date has no temperature beside it either
        columns, warmth = ("time_unix_s,gyro_z_rad_s,temperature_c", f",{20 + day}") if begin_s else ("t_s,gyro_z_rad_s", "")
        rows = "".join(f"{begin_s + t},{r:.9f}{warmth}\n" for t, r in zip(t_s, rate))
        place = folder / f"robot_{robot}"
        place.mkdir(parents=True, exist_ok=True)
        (place / f"{day}.csv").write_text(f"{columns}\n{rows}")

    for robot in range(6):
        for day in range(1 if robot == 5 else 5):
            off = 5e-3 if (robot, day) == (1, 4) or robot == 5 else 0.0
            begin_s = 0.0 if robot == 4 else 1.7e9 + 86_400.0 * day
            write(robot, day, begin_s, 0.0 if (robot, day) in ((0, 2), (4, 4)) else 2e-3, -5e-3 + 1e-4 * rng.normal() + off)


def run(folder: Path, *line: object) -> Answer:
    """What the program answers to a line."""
    command = [PROGRAM, *map(str, line), "--json", "-"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode in (0, 3), f"{line}: {done.stderr}"
    found: Answer = json.loads(done.stdout)
    return found


def standing_simulator(config: Any) -> Any:
    """The configuration of the gyro alone, standing still."""
    import gyroid

    gyro = config.to_dict()["gyro"]
    keys = ("c1_rad_s", "c2_rad_s", "time_constant_s", "angle_random_walk_rad_sqrt_s")
    lines = [f"{key} = {gyro[key]!r}" for key in keys]
    return gyroid.Configuration("\n".join(['schema = 1\nkind = "stationary"\nsample_time_s = 0.5\n[gyro]', *lines, ""]))
