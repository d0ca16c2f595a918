"""What `check.py` tries, one function a scenario; each starts the nodes it needs and ends them."""

import os
import signal
import time

from check import C2, CONFIG, TRUE_BIAS, Ears, Node, Sender, latencies_ms, numbers, run


def lost(heard, count):
    return count - len(set(numbers(heard)) & set(range(count)))


def lost_of_each(block, heard, count):
    """How many were lost of each `block` messages in the order of sending."""
    came = set(numbers(heard))
    return [block - len(came & set(range(first, first + block))) for first in range(0, count, block)]


def discovery(arguments, config, ears, table, figures):
    begin = time.monotonic()
    node = Node(arguments.program, config)
    try:
        ears.wait()
        seconds = time.monotonic() - begin
        heard = run(ears, Sender(200, 400))
        table.line("discovery", bool(heard), f"{seconds:.2f} s from the start to a match")
        figures["discovery_s"] = seconds
        message = heard[-1][1]
        rate, variance = message.angular_velocity[2], message.angular_velocity_covariance[8]
        # the reading is TRUE_BIAS and noise; at the start e is C2
        good = all(abs(m.angular_velocity[2] - (TRUE_BIAS - C2)) < 5e-3 for _, m in heard)
        good &= message.angular_velocity[:2] == [0.01, -0.02] and message.header.frame_id == "imu_link"
        good &= message.orientation_covariance[0] == -1.0 and 4e-6 < variance < 6e-6
        table.line("what a message holds", good, f"rate {rate:.2e} rad/s, variance {variance:.2e} rad²/s²")
        table.line("diagnostics", ears.status is not None and "bias_rad_s" in ears.status, f"{ears.status}"[:90])
    finally:
        code = node.stop()
    table.line("SIGTERM", code == 0, f"exit code {code}")


def no_loss(arguments, config, ears, table, figures):
    count = 200 * (3 if arguments.quick else 60)
    node = Node(arguments.program, config, "--quiet")
    try:
        ears.wait()
        heard = run(ears, Sender(200, count))
        missing = lost(heard, count)
        in_order = numbers(heard) == sorted(numbers(heard))
        table.line("loss at 200 Hz", missing == 0 and in_order, f"{missing} of {count}, in order: {in_order}")
        figures["lost"], figures["sent"] = missing, count
    finally:
        node.stop()


def latency(arguments, config, ears, table, figures):
    """From before the write to after the take, both in Python: the node, two ways through the network and two of Python."""
    import numpy

    count = 1000 * (4 if arguments.quick else 60)
    direct = run_direct(count // 4)
    node = Node(arguments.program, config, "--quiet")
    try:
        ears.wait()
        ears.look_every = float("inf")
        heard = run(ears, Sender(1000, count))
        ears.look_every = 0.5
        for name, limit, found in [
            ("latency at 1 kHz", arguments.limit_ms, latencies_ms(heard)),
            ("the same without the node", None, direct),
        ]:
            ms = numpy.array(found[len(found) // 20 :])
            median, p99, most = numpy.percentile(ms, 50), numpy.percentile(ms, 99), ms.max()
            text = f"median {median:.3f} ms, 99 % {p99:.3f} ms, most {most:.2f} ms of {len(ms)}"
            table.line(name, limit is None or p99 < limit, text)
            # ten bins a decade from 10 us to 1 s
            log10_ms = numpy.linspace(-2.0, 3.0, 51)
            counts = numpy.histogram(numpy.log10(numpy.clip(ms, 1e-2, 1e3)), log10_ms)[0]
            summary = {"median_ms": median, "p99_ms": p99, "max_ms": most}
            figures[name] = {**summary, "edges_log10_ms": log10_ms.round(9).tolist(), "counts": counts.tolist()}
        missing = lost(heard, count)
        figures["lost of each second at 1 kHz"] = lost_of_each(1000, heard, count)
        # at 1 kHz two Python processes and a loaded machine may drop one
        table.line("loss at 1 kHz", missing <= count // 1000, f"{missing} of {count}")
    finally:
        node.stop()


def run_direct(count):
    """Latency of Cyclone DDS to itself."""
    import messages
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic

    ears = Ears()
    topic = Topic(ears.participant, "rt/direct", messages.Imu)
    ears.imu = DataReader(ears.participant, topic, qos=messages.sensor_qos())
    return latencies_ms(run(ears, Sender(1000, count, topic="rt/direct"), extra=0.5))


def rest(arguments, config, ears, table, figures):
    node = Node(arguments.program, config, "--joints", "joint_states")
    try:
        ears.wait()
        heard = run(ears, Sender(200, 200 * (5 if arguments.quick else 20), wheels=True))
        bias, std = ears.last_bias.angular[2], ears.last_bias.covariance[35] ** 0.5
        good = abs(bias - TRUE_BIAS) < 4 * std and std < 2e-4 and bool(heard)
        text = f"bias {bias:.3e} ± {std:.1e} rad/s of {TRUE_BIAS:.1e}, NIS {ears.status.get('nis_mean')}"
        table.line("learns while the wheels stand", good, text)
    finally:
        node.stop()


def odometry(arguments, config, ears, table, figures):
    node = Node(arguments.program, config, "--odometry", "odom")
    try:
        ears.wait()
        run(ears, Sender(200, 200 * (5 if arguments.quick else 20), odometry=True))
        bias, std = ears.last_bias.angular[2], ears.last_bias.covariance[35] ** 0.5
        good = abs(bias - TRUE_BIAS) < 4 * std and std < 2e-4
        table.line("learns while an odometry stands", good, f"bias {bias:.3e} ± {std:.1e} rad/s of {TRUE_BIAS:.1e}")
    finally:
        node.stop()


def axes(arguments, config, ears, table, figures):
    """Three gyros by one node: what stands about x and y is 3e-4 rad/s from its configuration, as about z."""
    true = [0.01, -0.02, TRUE_BIAS]
    files = [config.with_name(f"{axis}.toml") for axis in "xyz"]
    for file, bias, away in zip(files, true, [3e-4, -3e-4, 3e-4]):
        file.write_text(CONFIG.format(c2=bias - away))
    node = Node(arguments.program, *files, "--axis", "x,y,z", "--joints", "joint_states", "--state", config.with_name("three.json"))
    try:
        ears.wait()
        heard = run(ears, Sender(200, 200 * (5 if arguments.quick else 20), wheels=True, axes=True))
        stds = [ears.last_bias.covariance[7 * (3 + k)] ** 0.5 for k in range(3)]
        errors = [found - bias for found, bias in zip(ears.last_bias.angular, true)]
        good = all(abs(error) < 4 * std < 8e-4 for error, std in zip(errors, stds))
        last = [message.angular_velocity for _, message in heard[-400:]]
        means = [sum(rates) / len(rates) for rates in zip(*last)]
        good &= all(abs(mean) < 1e-3 for mean in means)
        good &= all(heard[-1][1].angular_velocity_covariance[4 * k] > 0 for k in range(3))
        names = [status.name for status in ears.statuses]
        good &= names == [f"gyroid: gyro bias {axis}" for axis in "xyz"]
        node.stop()
        good &= all(config.with_name(f"three.{axis}.json").exists() for axis in "xyz")
        text = ", ".join(f"{error:+.1e} ± {std:.1e}" for error, std in zip(errors, stds))
        table.line("three axes", good, f"errors of the biases {text} rad/s")
    finally:
        node.stop()


def parameters(arguments, config, ears, table, figures):
    """As `ros2 param` asks under rmw_cyclonedds, while samples go on."""
    from messages import Parameter, ParameterValue
    from services import Asker

    def flag(name, on):
        return Parameter(name, ParameterValue(type=1, bool_value=on))

    def path(name, at):
        return Parameter(name, ParameterValue(type=4, string_value=str(at)))

    def one(name):
        return asker.ask("get_parameters", names=[name]).values[0]

    other = config.with_name("other.toml")
    other.write_text(CONFIG.format(c2=5e-3))
    missing = config.with_name("missing.toml")
    node = Node(arguments.program, config, "--joints", "joint_states", RMW_IMPLEMENTATION="rmw_cyclonedds_cpp")
    try:
        ears.wait()
        asker = Asker(ears.participant)
        # before the first sample, too
        early = asker.ask("set_parameters", parameters=[flag("learn", False)]).results[0]
        sender = Sender(200, 200 * 12, wheels=True).begin()
        heard = ears.hear(2.5)
        untaught = ears.status["rest_blocks_learnt"] == "0"
        names = asker.ask("list_parameters", prefixes=[], depth=0).result.names
        kinds = asker.ask("get_parameter_types", names=["config", "learn", "none"]).types
        about = asker.ask("describe_parameters", names=["imu", "learn"]).descriptors
        good = {"config", "extrapolate", "learn", "imu"} <= set(names) and list(kinds) == [4, 1, 0]
        good &= [d.read_only for d in about] == [True, False] and all(d.description for d in about)
        good &= one("config").string_value == str(config) and one("imu").string_value == "/imu/data_raw"
        table.line("parameters are listed, described, read", good, f"{', '.join(names)}"[:90])
        answers = asker.ask("set_parameters", parameters=[
            flag("learn", True), path("config", missing), path("imu", "/other"), path("learn", "no"), flag("nothing", True),
        ]).results
        reasons = [a.reason for a in answers]
        good = early.successful and [a.successful for a in answers] == [True, False, False, False, False]
        good &= "missing.toml" in reasons[1] and "start the node anew" in reasons[2] and "bool" in reasons[3]
        good &= "extrapolate" in reasons[4] and one("config").string_value == str(config) and one("learn").bool_value
        table.line("what cannot be set is refused with its reason", good and untaught, reasons[3])
        result = asker.ask("set_parameters_atomically", parameters=[flag("extrapolate", True), path("config", missing)]).result
        good = not result.successful and not one("extrapolate").bool_value
        result = asker.ask("set_parameters_atomically", parameters=[flag("extrapolate", True), path("config", other)]).result
        good &= result.successful and one("extrapolate").bool_value and one("config").string_value == str(other)
        table.line("all at once or none", good, f"extrapolate and config set: {result.successful}")
        heard += ears.hear(20.0, until=lambda: not sender.alive()) + ears.hear(1.0)
        changed = [p.name for e in asker.events() for p in e.changed_parameters]
        good = changed == ["learn", "learn", "extrapolate", "config"] and lost(heard, 2400) == 0
        mean = sum(m.angular_velocity[2] for _, m in heard[-100:]) / 100
        # what rest teaches brings the rate to zero whichever file is read
        good &= abs(mean) < 1e-3 and "set by a request: extrapolate, config" in node.words()
        table.line("parameter events, no sample lost", good, f"{changed}, {lost(heard, 2400)} of 2400 lost, rate {mean:.1e}")
    finally:
        code = node.stop()
    table.line("ends after requests", code == 0, f"exit code {code}")


def other_services(arguments, config, ears, table, figures):
    """Requests without Cyclone's header, as Fast DDS and Connext send them."""
    from messages import Parameter, ParameterValue
    from services import Asker

    node = Node(arguments.program, config, RMW_IMPLEMENTATION="rmw_fastrtps_cpp")
    try:
        ears.wait()
        asker = Asker(ears.participant, header=False)
        wanted = [Parameter("learn", ParameterValue(type=1)), Parameter("config", ParameterValue(type=4, string_value="/none.toml"))]
        learn, missing = asker.ask("set_parameters", parameters=wanted).results
        value = asker.ask("get_parameters", names=["learn"]).values[0]
        good = learn.successful and not missing.successful and "/none.toml" in missing.reason and value.type == 1 and not value.bool_value
        table.line("parameters without Cyclone's header", good, missing.reason)
    finally:
        node.stop()


def restarts(arguments, config, ears, table, figures):
    state = config.with_name("state.json")
    options = ["--joints", "joint_states", "--state", state]
    nodes, sender = [Node(arguments.program, config, *options)], None
    try:
        ears.wait()
        # the sender goes on over all of it
        sender = Sender(200, 200 * 40, wheels=True).begin()
        before = ears.hear(4.0)
        learnt = ears.last_bias.angular[2]
        code = nodes[0].stop()
        kept = state.exists()
        ears.wait(publishers=0)
        ears.drop()
        begin = time.monotonic()
        nodes.append(Node(arguments.program, config, *options))
        again = ears.hear(10.0, first=True)
        seconds = time.monotonic() - begin
        again += ears.hear(2.0)
        text = f"{len(again)} messages, the first {seconds:.1f} s after the start"
        table.line("restart of the node", code == 0 and bool(before) and len(again) > 300, text)
        age, bias = float(ears.status["warm_up_age_s"]), ears.last_bias.angular[2]
        good = kept and age > 4.0 and abs(bias - learnt) < 1e-4 and "is kept" in nodes[1].words()
        table.line("what it had learnt is kept", good, f"age {age:.1f} s, bias {bias:.3e}, before {learnt:.3e} rad/s")
        sender.end()
        ears.drop()
        heard = run(ears, Sender(200, 400))
        table.line("restart of the sender", lost(heard, 400) == 0, f"{lost(heard, 400)} of 400 lost")
    finally:
        if sender:
            sender.end()
        for node in nodes:
            node.stop()


def clock(arguments, config, ears, table, figures):
    node = Node(arguments.program, config)
    try:
        ears.wait()
        heard = run(ears, Sender(200, 600, jumps={200: 3600.0, 400: -7200.0}))
        status = ears.status
        good = lost(heard, 600) == 0 and status["clock_jumps"] == "2"
        age = float(status["age_since_power_on_s"])
        good &= 2.5 < age < 5.0
        rates = [m.angular_velocity[2] for _, m in heard]
        good &= max(abs(r - (TRUE_BIAS - C2)) for r in rates) < 6e-3
        table.line("clock set 1 h on, 2 h back", good, f"jumps {status['clock_jumps']}, age {age:.1f} s, no loss")
    finally:
        node.stop()


def storm(arguments, config, ears, table, figures):
    node = Node(arguments.program, config)
    try:
        ears.wait()
        run(ears, Sender(200, 100))
        before, count = node.rss_kib(), 20_000 if arguments.quick else 100_000
        begin = time.monotonic()
        stormed = run(ears, Sender(1e6, count))
        seconds = time.monotonic() - begin - 2.0
        after = node.rss_kib()
        figures["lost of each 1000 of a storm"] = lost_of_each(1000, stormed, count)
        heard = run(ears, Sender(200, 400))
        good = node.alive() and lost(heard, 400) == 0 and after - before < 64 * 1024
        text = f"{count} in {seconds:.1f} s: {len(stormed)} came through, {before} to {after} KiB; then {lost(heard, 400)} of 400 lost"
        table.line("storm", good, text)
    finally:
        node.stop()


def malformed(arguments, config, ears, table, figures):
    import messages
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.pub import DataWriter
    from cyclonedds.topic import Topic

    node = Node(arguments.program, config)
    try:
        ears.wait()
        participant = DomainParticipant(0)
        topic = Topic(participant, "rt/imu/data_raw", messages.NoImu)
        writer = DataWriter(participant, topic, qos=messages.sensor_qos())
        while not writer.get_matched_subscriptions():
            time.sleep(0.01)
        time.sleep(0.3)
        bad = [
            [],
            [1, 2, 3],
            # the length of frame_id says 4 GiB, then text that is no UTF-8
            [0] * 4 + [255] * 4 + [0] * 300,
            [0] * 4 + [4, 0, 0, 0, 255, 254, 253, 0] + [0] * 300,
            # a whole message whose frame_id is longer than any
            [0] * 4 + [0, 1, 0, 0] + [65] * 255 + [0] + [0] * 400,
            list(os.urandom(500)),
        ]
        sent = 0
        for _ in range(20):
            for data in bad:
                writer.write(messages.NoImu(data))
                sent += 1
                time.sleep(0.002)
        heard = run(ears, Sender(200, 400))
        found = int(ears.status["malformed"])
        good = node.alive() and lost(heard, 400) == 0 and found >= 0.8 * sent
        table.line("malformed CDR", good, f"{found} of {sent} counted, then {lost(heard, 400)} of 400 lost")
    finally:
        node.stop()


def two_of_one_name(arguments, config, ears, table, figures):
    first = Node(arguments.program, config, "--quiet")
    second = Node(arguments.program, config, "--quiet")
    try:
        ears.wait(publishers=2)
        both = numbers(run(ears, Sender(200, 400)))
        twice = sum(both.count(number) == 2 for number in range(400))
        second.stop()
        ears.wait(publishers=1)
        ears.drop()
        heard = run(ears, Sender(200, 400))
        good = twice == 400 and first.alive() and lost(heard, 400) == 0
        table.line("two nodes of one name", good, f"{twice} of 400 from both, then {lost(heard, 400)} of 400 lost")
    finally:
        first.stop()
        second.stop()


def reload(arguments, config, ears, table, figures):
    node = Node(arguments.program, config)
    try:
        ears.wait()
        sender = Sender(200, 200 * 9).begin()
        heard = ears.hear(2.5)
        config.write_text(CONFIG.format(c2=5e-3))
        heard += ears.hear(2.0)
        changed = sum(m.angular_velocity[2] for _, m in heard[-100:]) / 100
        config.write_text("schema = 1\n[gyro]\n")
        node.process.send_signal(signal.SIGHUP)
        heard += ears.hear(2.0)
        refused = ears.status["level"] == 1 and "goes on" in node.words()
        config.write_text(CONFIG.format(c2=C2))
        heard += ears.hear(10.0, until=lambda: not sender.alive()) + ears.hear(1.0)
        back = sum(m.angular_velocity[2] for _, m in heard[-100:]) / 100
        good = abs(changed - (TRUE_BIAS - 5e-3)) < 1e-3 and refused and abs(back - (TRUE_BIAS - C2)) < 1e-3 and lost(heard, 200 * 9) == 0
        table.line("reload without stopping", good, f"{lost(heard, 1800)} of 1800 lost, rates {changed:.1e}, {back:.1e}")
    finally:
        config.write_text(CONFIG.format(c2=C2))
        node.stop()


def soak(arguments, config, ears, table, figures):
    count = int(200 * arguments.soak)
    node = Node(arguments.program, config, "--joints", "joint_states", "--state", config.with_name("state.json"))
    try:
        ears.wait()
        sender = Sender(200, count, wheels=True).begin()
        seen, begin = 0, time.monotonic()
        ears.hear(20.0)
        seen, before = None, node.rss_kib()
        print(f"        after 20 s {before} KiB", flush=True)
        heard = 0
        next_said = 300.0
        while sender.alive():
            heard += len(ears.hear(10.0, until=lambda: not sender.alive()))
            if time.monotonic() - begin > next_said:
                print(f"        after {next_said:.0f} s {node.rss_kib()} KiB", flush=True)
                next_said += 300.0
        # the count comes once a second
        ears.hear(2.5)
        samples = int(ears.status["samples"])
        after = node.rss_kib()
        good = samples == count and after - before < 2048
        text = f"{samples} of {count} in {time.monotonic() - begin:.0f} s, memory {before} to {after} KiB"
        table.line("soak at 200 Hz", good, text)
        figures["soak"] = {"seconds": arguments.soak, "before_kib": before, "after_kib": after, "samples": samples}
    finally:
        node.stop()


SCENARIOS = [
    discovery, no_loss, latency, rest, odometry, axes, parameters, other_services, restarts, clock, storm, malformed,
    two_of_one_name, reload,
]
