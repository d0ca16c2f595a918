#!/usr/bin/env python3
"""Reads recordings of `--mcap` back with the readers of others, and holds them against what the commands write elsewhere.

    cargo build
    pip install polars mcap mcap-ros2-support mcap-protobuf-support
    python3 tests/mcap/check.py [target/debug/gyroid]
"""
import json
import math
import pathlib
import subprocess
import sys
import tempfile

import polars
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory as Protobuf
from mcap_ros2.decoder import DecoderFactory as Ros2

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "target/debug/gyroid").resolve()


def gyroid(*arguments):
    done = subprocess.run([PROGRAM, *map(str, arguments)], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode in (0, 3), done.stderr


def read(path):
    """Messages of each topic, with their log times in s; chunks have an index, and log times never go back."""
    topics = {}
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[Protobuf(), Ros2()])
        summary = reader.get_summary()
        assert summary.chunk_indexes and summary.statistics.message_count > 0
        last = -1
        for _, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
            assert message.log_time >= last, channel.topic
            last = message.log_time
            topics.setdefault(channel.topic, []).append((message.log_time * 1e-9, decoded))
    assert sum(map(len, topics.values())) == summary.statistics.message_count
    return topics


def layout(path, topics):
    """Every topic that the layout shows is in the recording, or is one that not every recording has."""
    shown = json.loads(path.with_suffix(".foxglove.json").read_text())
    panels = shown["configById"]

    def leaves(node):
        return [node] if isinstance(node, str) else leaves(node["first"]) + leaves(node["second"])

    assert sorted(leaves(shown["layout"])) == sorted(panels)
    paths = [p["value"] for panel in panels.values() for p in panel.get("paths", [])]
    paths += [panel["topicPath"] for panel in panels.values() if "topicPath" in panel]
    for path in paths:
        assert path.split(".")[0] in topics, path


def equal(found, wanted, tolerance=0.0):
    assert math.isclose(found, wanted, rel_tol=tolerance, abs_tol=tolerance), (found, wanted)


def robot(folder):
    gyroid("fit", "data/power_on.csv", "--base", "data/robot.toml", "-o", folder / "robot.toml", "--no-plot")
    return folder / "robot.toml"


def navigate(folder):
    recording = folder / "drive.mcap"
    gyroid("navigate", robot(folder), "data/drive.parquet", "-o", folder / "pose.parquet", "--mcap", recording,
           "--json", folder / "drive.json")
    topics = read(recording)
    layout(recording, topics)
    drive, pose = (polars.read_parquet(path) for path in (ROOT / "data/drive.parquet", folder / "pose.parquet"))
    answer = json.loads((folder / "drive.json").read_text())
    assert len(topics["/odom"]) == len(topics["/tf"]) == len(pose)
    times = pose.columns[0]
    for row in (0, len(pose) // 2, len(pose) - 1):
        time_s, odom = topics["/odom"][row]
        wanted = pose.row(row, named=True)
        equal(time_s, wanted[times], 1e-9)
        equal(odom.header.stamp.sec + 1e-9 * odom.header.stamp.nanosec, wanted[times], 1e-9)
        equal(odom.pose.pose.position.x, wanted["x_m"])
        equal(odom.pose.covariance[7], wanted["y_std_m"] ** 2, 1e-12)
        equal(odom.pose.covariance[35], wanted["heading_std_rad"] ** 2, 1e-12)
        equal(odom.twist.twist.angular.z, wanted["yaw_rate_rad_s"])
        q = odom.pose.pose.orientation
        equal(math.remainder(2.0 * math.atan2(q.z, q.w) - wanted["heading_rad"], math.tau), 0.0, 1e-9)
        _, tf = topics["/tf"][row]
        assert [(t.header.frame_id, t.child_frame_id) for t in tf.transforms] == [("map", "odom"), ("odom", "base_link")]
        (_, raw), (_, corrected), (_, bias) = (topics[name][row] for name in ("/imu/data_raw", "/imu/data", "/bias"))
        equal(raw.angular_velocity.z, drive["gyro_z_rad_s"][row])
        equal(raw.angular_velocity.z - corrected.angular_velocity.z, bias.twist.twist.angular.z, 1e-12)
        equal(bias.twist.covariance[35], wanted["gyro_error_std_rad_s"] ** 2, 1e-12)
        assert raw.orientation_covariance[0] == -1.0
    _, joints = topics["/joint_states"][5]
    assert list(joints.name) == ["left_wheel", "right_wheel"]
    assert list(joints.velocity) == [drive["wheel_left_rad_s"][5], drive["wheel_right_rad_s"][5]]
    assert list(joints.effort) == [drive["torque_left_n_m"][5], drive["torque_right_n_m"][5]]
    read_at = drive.filter(polars.col("x_m").is_finite())
    assert len(topics["/reference"]) == len(read_at)
    equal(topics["/reference"][-1][1].pose.position.y, read_at["y_m"][-1])
    [(_, verdict)] = topics["/gyroid/verdict"]
    assert (verdict.command, verdict.verdict == "fit_for_use") == ("navigate", answer["fit_for_use"])
    consistency = answer["with_error_model"]["consistency"]
    [nis] = [q.value for q in verdict.quantities if q.name == "mean NIS"]
    equal(nis, consistency["nis_mean"])
    sensors = {s["sensor"]: s for s in consistency["sensors"]}
    for name, of in (("gyro", "gyro"), ("wheel_left", "wheel_left")):
        innovations = [message for _, message in topics[f"/gyroid/innovation/{name}"] if message.used]
        mean = sum(i.residual**2 / i.std**2 for i in innovations) / len(innovations)
        equal(mean, sensors[of]["nis_mean"], 1e-9)
    return topics


def noise(folder):
    recording = folder / "noise.mcap"
    gyroid("noise", "data/power_on.csv", "--draws", "99", "--mcap", recording, "--json", folder / "noise.json")
    topics = read(recording)
    layout(recording, topics)
    answer = json.loads((folder / "noise.json").read_text())
    [(_, verdict)] = topics["/gyroid/verdict"]
    assert [(q.name, q.value, list(q.ci95)) for q in verdict.quantities] == [
        (t["id"], t["estimate"], t["ci95"]) for t in answer["terms"]
    ]
    curves = {message.name: message for _, message in topics["/gyroid/curve"]}
    points = answer["deviations"]["overlapping_allan"]
    curve = curves["overlapping_allan deviation over averaging time"]
    assert list(curve.x) == [p["tau_s"] for p in points]
    assert list(curve.bands[0].high) == [p["ci95"][1] for p in points]
    return topics


def gap_of_a_drive(folder):
    recording = folder / "gap.mcap"
    gyroid("gap", "diagnose", robot(folder), "--fit", "data/drives/rover_fit.parquet", "--hold",
           "data/drives/rover_hold.parquet", "--mcap", recording, "--json", folder / "gap.json")
    topics = read(recording)
    layout(recording, topics)
    answer = json.loads((folder / "gap.json").read_text())
    held = polars.read_parquet(ROOT / "data/drives/rover_hold.parquet")
    gyro = topics["/gyroid/compared/gyro_z_rad_s"]
    assert [m.recorded for _, m in gyro] == held["gyro_z_rad_s"].drop_nulls().to_list()
    [(_, verdict)] = topics["/gyroid/verdict"]
    assert verdict.verdict == answer["verdict"] == "identified" and answer["main"] in verdict.text
    # the simulator with the effect is nearer to what was recorded
    far = [sum((getattr(m, side) - m.recorded) ** 2 for _, m in gyro if math.isfinite(getattr(m, side)))
           for side in ("before", "after")]
    assert far[1] < far[0], far
    assert topics["/pose/recorded"] and topics["/pose/after"]
    return topics


def gap_at_rest(folder):
    sim, log, recording = folder / "sim.toml", folder / "rest.parquet", folder / "rest.mcap"
    gyroid("fit", "data/power_on.csv", "-o", sim, "--no-plot", "--accept")
    gyroid("simulate", sim, "--duration", "600", "--seed", "3", "-o", log)
    gyroid("gap", "diagnose", sim, "--fit", log, "--mcap", recording, "--json", folder / "rest.json")
    topics = read(recording)
    layout(recording, topics)
    curves = json.loads((folder / "rest.json").read_text())["curves"]
    [over_time] = [c for c in curves if c["over"] == "time" and c["shown"] == "deviation"]
    band = topics["/gyroid/band/deviation"]
    assert [m.before_high for _, m in band] == [b[1] for b in over_time["before"]]
    assert len(topics["/gyroid/curve"]) == sum(c["over"] != "time" for c in curves)
    return topics


def main():
    for check in (navigate, noise, gap_of_a_drive, gap_at_rest):
        with tempfile.TemporaryDirectory() as folder:
            topics = check(pathlib.Path(folder))
        print(f"{check.__name__}: {len(topics)} topics, {sum(map(len, topics.values()))} messages")


if __name__ == "__main__":
    main()
