#!/usr/bin/env python3
"""`gyroid ros` against another vendor's DDS: Cyclone DDS, in a network name space of its own.

    python3 -m venv venv && venv/bin/pip install cyclonedds numpy
    cargo build --release --features ros2
    venv/bin/python tests/ros/check.py target/release/gyroid          # four minutes
    venv/bin/python tests/ros/check.py --quick target/release/gyroid  # about a minute
    venv/bin/python tests/ros/check.py --soak 3600 target/release/gyroid

Prints a table and exits 1 where a line of it failed. Needs no ROS installation.
"""

import argparse
import gc
import json
import multiprocessing
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

INSIDE = "GYROID_CHECK_INSIDE"
CONFIG = """schema = 1
sample_time_s = 0.005
[gyro]
c1_rad_s = -2.4e-3
c2_rad_s = {c2}
time_constant_s = 240.0
angle_random_walk_rad_sqrt_s = 1.5e-4
turn_on_bias_std_rad_s = 4e-4
"""
C2, TRUE_BIAS = 8e-3, 8.3e-3


def in_a_name_space():
    """Runs this program again in a network name space with nothing but a loopback, where that is permitted."""
    if os.environ.get(INSIDE) or not shutil.which("unshare"):
        return
    for flags in (["-n"], ["-r", "-n"]):
        if subprocess.run(["unshare", *flags, "ip", "link", "set", "lo", "up"], capture_output=True).returncode == 0:
            inner = ["sh", "-c", 'ip link set lo up && exec "$@"', "sh", sys.executable, *sys.argv]
            os.execvpe("unshare", ["unshare", *flags, *inner], {**os.environ, INSIDE: "1"})
    print("no network name space is permitted here: the check runs on the machine's own loopback")


class Node:
    """A running `gyroid ros`."""

    def __init__(self, program, config, *options, **environment):
        self.log = tempfile.TemporaryFile("w+")
        command = [str(program), "ros", str(config), *map(str, options)]
        environment = {**os.environ, **environment}
        self.process = subprocess.Popen(command, stdout=self.log, stderr=subprocess.STDOUT, env=environment)

    def words(self):
        self.log.seek(0)
        return self.log.read()

    def rss_kib(self):
        status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
        return next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmRSS"))

    def alive(self):
        return self.process.poll() is None

    def stop(self):
        """Ends it as a user would; its exit code."""
        if self.alive():
            self.process.send_signal(signal.SIGTERM)
        try:
            return self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            return self.process.wait()


def send(topic, rate_hz, count, options, matched, go):
    """A process that sends `count` messages; it reports itself matched, and begins when told to."""
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.pub import DataWriter
    from cyclonedds.topic import Topic

    import messages

    gc.disable()
    participant = DomainParticipant(0)
    writer = DataWriter(participant, Topic(participant, topic, messages.Imu), qos=messages.sensor_qos())
    joints, odometry = None, None
    if options.get("odometry"):
        odometry_topic = Topic(participant, "rt/odom", messages.Odometry)
        odometry = DataWriter(participant, odometry_topic, qos=messages.sensor_qos())
    if options.get("wheels"):
        joint_topic = Topic(participant, "rt/joint_states", messages.JointState)
        joints = DataWriter(participant, joint_topic, qos=messages.sensor_qos())
    while not writer.get_matched_subscriptions():
        time.sleep(0.01)
    matched.set()
    go.wait()
    time.sleep(0.2)
    begin, stamp0 = time.monotonic(), time.time()
    bias = options.get("bias", TRUE_BIAS)
    jumps = options.get("jumps", {})
    shift = 0.0
    state = 12345
    for number in range(count):
        due = begin + number / rate_hz
        left = due - time.monotonic()
        if left > 0:
            time.sleep(left)
        shift = jumps.get(number, shift)
        # uniform noise of the stated standard deviation: 1.5e-4 rad/sqrt(s) at 200 Hz
        state = (1103515245 * state + 12345) % 2**31
        noise = (state / 2**31 - 0.5) * 12**0.5 * 1.5e-4 * rate_hz**0.5
        message = messages.imu(stamp0 + number / rate_hz + shift, number, bias + noise)
        if options.get("axes"):
            message.angular_velocity[0] += noise
            message.angular_velocity[1] -= noise
        message.linear_acceleration[1] = float(time.monotonic_ns() % 2**50)
        writer.write(message)
        if joints is not None and number % 4 == 0:
            header = messages.Header(stamp=message.header.stamp, frame_id="")
            joints.write(messages.JointState(header, ["left", "right"], [1.0, 2.0], [0.0, 0.0], []))
        if odometry is not None and number % 4 == 0:
            pose = [[1.0, 2.0, 0.0], [0.0, 0.0, 0.6, 0.8], [0.0] * 36]
            odometry.write(messages.Odometry(message.header, "base_link", *pose, [0.0] * 3, [0.0] * 3, [0.0] * 36))
    # what is under way arrives before the writer is gone
    time.sleep(0.2)


class Sender:
    """`send` in a process of its own."""

    def __init__(self, rate_hz, count, topic="rt/imu/data_raw", **options):
        context = multiprocessing.get_context("spawn")
        matched, self.go = context.Event(), context.Event()
        arguments = (topic, rate_hz, count, options, matched, self.go)
        self.process = context.Process(target=send, args=arguments, daemon=True)
        self.process.start()
        self.matched = matched.wait(20)
        self.seconds = count / rate_hz

    def begin(self):
        self.go.set()
        return self

    def alive(self):
        return self.process.is_alive()

    def end(self):
        self.process.kill()
        self.process.join()


class Ears:
    """Readers of what the node publishes."""

    def __init__(self):
        from cyclonedds.domain import DomainParticipant
        from cyclonedds.sub import DataReader
        from cyclonedds.topic import Topic

        import messages

        self.participant = DomainParticipant(0)

        def reader(topic, kind, qos):
            return DataReader(self.participant, Topic(self.participant, topic, kind), qos=qos)

        self.imu = reader("rt/imu/data", messages.Imu, messages.sensor_qos())
        self.bias = reader("rt/gyroid/bias", messages.TwistWithCovarianceStamped, messages.sensor_qos())
        self.diagnostics = reader("rt/diagnostics", messages.DiagnosticArray, messages.reliable_qos())
        self.status, self.statuses, self.last_bias = None, [], None
        # s between two looks at bias and diagnostics, for which the other messages wait
        self.look_every = 0.5

    def wait(self, publishers=1, seconds=20):
        """Until so many nodes publish; s it took."""
        begin = time.monotonic()
        while len(self.imu.get_matched_publications()) != publishers:
            if time.monotonic() - begin > seconds:
                raise TimeoutError(f"{len(self.imu.get_matched_publications())} publishers, not {publishers}")
            time.sleep(0.01)
        return time.monotonic() - begin

    def hear(self, seconds, until=None, first=False):
        """Messages of so many seconds, or until `until()`, or just the `first` ones, with their arrival, ns."""
        from cyclonedds.core import ReadCondition, SampleState, ViewState, InstanceState, WaitSet

        heard, looked, end = [], time.monotonic(), time.monotonic() + seconds
        waits = WaitSet(self.participant)
        waits.attach(ReadCondition(self.imu, SampleState.Any | ViewState.Any | InstanceState.Any))
        while time.monotonic() < end and not (until and until()) and not (first and heard):
            waits.wait(100_000_000)
            now = time.monotonic_ns()
            heard += [(now, m) for m in self.imu.take(500) if hasattr(m, "header")]
            if time.monotonic() - looked > self.look_every:
                looked = time.monotonic()
                self.look()
        self.look()
        return heard

    def look(self):
        for message in self.diagnostics.take(100):
            self.statuses = getattr(message, "status", self.statuses)
            for status in getattr(message, "status", []):
                self.status = {"level": status.level, "message": status.message}
                self.status |= {v.key: v.value for v in status.values}
        for message in self.bias.take(1000):
            self.last_bias = message if hasattr(message, "angular") else self.last_bias

    def drop(self):
        while self.imu.take(5000):
            pass


def numbers(heard):
    return [int(m.linear_acceleration[0]) for _, m in heard]


def latencies_ms(heard):
    return [(now % 2**50 - m.linear_acceleration[1]) * 1e-6 for now, m in heard]


def run(ears, sender, extra=1.2):
    """All that is heard of a sender."""
    sender.begin()
    heard = ears.hear(sender.seconds + 20, until=lambda: not sender.alive())
    return heard + ears.hear(extra)


class Table:
    """What was checked, and how it came out."""

    def __init__(self):
        self.failed = False

    def line(self, name, good, found):
        self.failed |= not good
        print(f"{'ok' if good else 'FAILED':7} {name:34} {found}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("--quick", action="store_true", help="shorter runs: about a minute")
    parser.add_argument("--soak", type=float, metavar="S", help="nothing but so many seconds at 200 Hz, and the memory")
    parser.add_argument("--limit-ms", type=float, default=1.0, help="largest 99th percentile of the latency")
    parser.add_argument("--only", nargs="+", default=[], metavar="SCENARIO", help="functions of scenarios.py")
    parser.add_argument("--json", type=pathlib.Path, help="figures, for the book")
    arguments = parser.parse_args()
    in_a_name_space()
    # Python's collector stops it for up to 0.2 s where tens of thousands of messages are held
    gc.disable()
    from scenarios import SCENARIOS, soak

    table, figures = Table(), {}
    with tempfile.TemporaryDirectory() as folder:
        config = pathlib.Path(folder, "gyroid.toml")
        config.write_text(CONFIG.format(c2=C2))
        ears = Ears()
        wanted = [soak] if arguments.soak else [s for s in SCENARIOS if not arguments.only or s.__name__ in arguments.only]
        for scenario in wanted:
            try:
                scenario(arguments, config, ears, table, figures)
            except Exception as error:  # a scenario that breaks is a line of the table, not the end of it
                table.line(scenario.__name__, False, f"{type(error).__name__}: {error}")
            ears.drop()
    if arguments.json:
        arguments.json.write_text(json.dumps(figures, indent=1))
    sys.exit(1 if table.failed else 0)


if __name__ == "__main__":
    main()
