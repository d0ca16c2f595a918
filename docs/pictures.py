"""Draws the pictures of README and book anew, by the program itself: python docs/pictures.py GYROID

Pictures of commands are the SVG that the command drew, cut to the panel that is shown, with points left out that lie on the line
of their neighbours to a quarter of a pixel. Traces of effects are two simulations with the same random numbers, with the effect
and without it.
"""

import csv
import json
import math
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
OUT = ROOT / "docs/src/pictures"

FIT = "fit data/power_on.csv --base data/robot.toml -o robot.toml --no-plot"
DIAGNOSE = "gap diagnose robot.toml --fit data/drives/rover_fit.parquet --hold data/drives/rover_hold.parquet --plot {0} --write-sim augmented.toml"
TONE = '[[effect]]\nid = "gyro.tone"\nfrequency_hz = 1.3\namplitude_rad_s = 3e-4\n'
AT_REST = "simulate real.toml --duration 1800 --seed {} -o {}.parquet"
# name: commands, the last of which draws {0}; and what of it is shown: x, y, width, height of the picture, in parts
COMMANDS = {
    "gap_closed": ([FIT, DIAGNOSE.format("gap.svg"), "navigate augmented.toml data/drives/rover_hold.parquet --plot {0}"], (0, 0.083, 0.492, 0.917)),
    "fit": (["fit data/cats_coldsoak_a.csv --axis z --plot {0}"], (0, 0, 1, 1)),
    "noise": (["noise data/cats_coldsoak_a.csv --axis z --plot {0}"], (0, 0, 1, 1)),
    "navigate": ([FIT, "navigate robot.toml data/drive.parquet --plot {0}"], (0, 0, 1, 1)),
    "gap_drive": ([FIT, DIAGNOSE], (0, 0, 1, 1)),
    "gap_rest": (
        [AT_REST.format(1, "fit"), AT_REST.format(2, "hold"), "gap diagnose sim.toml --fit fit.parquet --hold hold.parquet --plot {0}"],
        (0, 0, 1, 1),
    ),
}

# effects at rest: parameters, length of the trace in s, whether the readings themselves are shown and not what is added
REST = {
    "gyro.rate_random_walk": ("rate_random_walk_rad_s_sqrt_s = 2e-5", 1800, False),
    "gyro.bias_instability": ("bias_instability_rad_s = 2e-4", 1800, False),
    "gyro.gauss_markov": ("correlation_time_s = 60.0\nstd_rad_s = 2e-4", 1800, False),
    "gyro.quantization": ("lsb_rad_s = 1e-3", 20, True),
    "gyro.rate_ramp": ("ramp_rad_s2 = 2e-7", 1800, False),
    "gyro.second_time_constant": ("c3_rad_s = -4e-4\ntime_constant_s = 20.0", 300, False),
    "gyro.temperature_sensitivity": ("coefficient_rad_s_per_c = 3e-5\nlag_s = 30.0", 1800, False),
    "gyro.supply_sensitivity": ("coefficient_rad_s_per_v = 3e-3", 1800, False),
    "gyro.tone": ("frequency_hz = 0.7\namplitude_rad_s = 5e-4", 20, False),
    "gyro.bias_step": ("step_rad_s = -3e-4\ntime_s = 700.0", 1800, False),
    "gyro.outliers": ("probability_per_sample = 0.01", 300, True),
    "gyro.telegraph_noise": ("level_spacing_rad_s = 5e-4\nmean_dwell_s = 90.0", 1800, False),
    "gyro.bandwidth": ("cutoff_hz = 0.5", 60, True),
    "gyro.noise_growth": ("relative_per_c = 0.08", 1800, True),
    "gyro.turn_on_shift": ("shift_rad_s = 1.5e-3", 1800, True),
    "gyro.warm_up": ("c1_rad_s = 3e-3\ntime_constant_s = 120.0", 1800, True),
    "gyro.noise_level": ("noise_over_nominal = 2.0", 60, True),
    "gyro.narrow_band_noise": ("center_hz = 1.0\nbandwidth_hz = 0.1\nstd_rad_s = 5e-4", 60, False),
}

# effects of drives: parameters
DRIVE = {
    "wheel.slip": "compliance = 0.3",
    "wheel.radius_mismatch": "right_over_left_minus_one = 0.03",
    "wheel.radius_scale": "relative = 0.03",
    "wheel.radius_left": "relative = 0.03",
    "wheel.radius_right": "relative = 0.03",
    "wheel.rolling_resistance": "coefficient = 0.02",
    "wheel.lateral_skid": "lateral_slip_s = 0.05",
    "vehicle.track_width": "relative = 0.1",
    "vehicle.payload": "mass_relative = 0.2",
    "vehicle.com_offset": "offset_m = 0.05",
    "motor.torque_gain": "right_over_left_minus_one = 0.05",
    "encoder.quantization": "lsb_rad_s = 0.3",
    "encoder.missed_ticks": "loss_fraction = 0.4\nshare_of_time = 0.2",
    "gyro.scale_factor": "relative = 0.03",
    "gyro.scale_asymmetry": "relative = 0.03",
    "gyro.vibration_rectification": "coefficient_rad_s_per_m2_s2 = 0.01",
    "gyro.bias_step": "step_rad_s = 0.01",
    "sensor.gyro_delay": "delay_s = 0.05",
    "sensor.wheel_delay": "delay_s = 0.05",
    "sensor.pose_delay": "delay_s = 0.1",
    "gyro.noise_level": "noise_over_nominal = 2.0",
    "encoder.noise_level": "noise_over_nominal = 2.0",
    "pose.noise_level": "noise_over_nominal = 3.0",
    "ground.slope": "slope_rad = 0.02\nuphill_heading_rad = 0.7",
}

REST_SIMULATOR = """schema = 1
sample_time_s = 0.1
[gyro]
c1_rad_s = -2.4e-3
c2_rad_s = 8.0e-3
time_constant_s = 240.0
angle_random_walk_rad_sqrt_s = 1.5e-4
turn_on_bias_std_rad_s = 2e-4
warm_up_relative_std = 0.03
"""

# what is compared of a drive: columns, their noise, label
SHOWN = [
    (["gyro_z_rad_s"], 1.5e-3, "gyro, mrad/s", 1e3),
    (["wheel_left_rad_s", "wheel_right_rad_s"], 0.02, "wheels, rad/s", 1.0),
    (["x_m", "y_m"], 0.002, "x, y of the pose, m", 1.0),
]
BLUE, ORANGE, GREY, INK = "#0072B2", "#D55E00", "#999999", "#1A1A1A"


def simplified(points, tolerance):
    """Douglas and Peucker: points that lie within `tolerance` of the line of those that stay are left out."""
    keep, stack = {0, len(points) - 1}, [(0, len(points) - 1)]
    while stack:
        a, b = stack.pop()
        (x0, y0), (x1, y1) = points[a], points[b]
        length = math.hypot(x1 - x0, y1 - y0)
        far, at = 0.0, None
        for i in range(a + 1, b):
            x, y = points[i]
            d = abs((x1 - x0) * (y0 - y) - (x0 - x) * (y1 - y0)) / length if length else math.hypot(x - x0, y - y0)
            if d > far:
                far, at = d, i
        if at is not None and far > tolerance:
            keep.add(at)
            stack += [(a, at), (at, b)]
    return [points[i] for i in sorted(keep)]


def slim(svg, part):
    """The SVG, cut to a part of itself, without points that nobody sees and elements outside."""
    width, height = (float(v) for v in re.search(r'viewBox="0 0 (\S+) (\S+)"', svg).groups())
    pixels = [float(v) for v in re.search(r'<svg width="(\S+)" height="(\S+)"', svg).groups()]
    x, y, w, h = part[0] * width, part[1] * height, part[2] * width, part[3] * height
    scale = width / pixels[0]

    def shorter(match):
        points = [tuple(map(float, p.split(","))) for p in match.group(2).split()]
        if all(px > x + w for px, _ in points) or all(py > y + h for _, py in points):
            return ""
        points = simplified(points, 0.25 * scale) if len(points) > 2 else points
        return match.group(1) + " ".join(f"{px:.0f},{py:.0f}" for px, py in points) + match.group(3)

    svg = re.sub(r'(<polyline [^>]*points=")([^"]*)("/>\n?)', shorter, svg)
    # dashes are lines of their own: those of one line become one path
    svg = re.sub(r'(?:<polyline ([^>]*) points="[^"]*"/>\n?)(?:<polyline \1 points="[^"]*"/>\n?)+', one_path, svg)
    svg = re.sub(r'<text x="([\d.]+)"[^>]*>[^<]*</text>\n?', lambda m: "" if float(m.group(1)) > x + w else m.group(0), svg)
    svg = svg.replace(f'viewBox="0 0 {width:g} {height:g}"', f'viewBox="{x:.0f} {y:.0f} {w:.0f} {h:.0f}"')
    return re.sub(r'<svg width="\S+" height="\S+"', f'<svg width="{w / scale:.0f}" height="{h / scale:.0f}"', svg, count=1)


def one_path(match):
    lines = re.findall(r'points="([^"]*)"', match.group(0))
    return f'<path {match.group(1)} d="' + "".join("M" + line.strip().replace(" ", "L") for line in lines) + '"/>\n'


def ticks(low, high):
    step = 10 ** math.floor(math.log10((high - low) / 2))
    step *= next(m for m in (1, 2, 5, 10) if (high - low) / (m * step) <= 4)
    first = math.ceil(low / step)
    return [i * step for i in range(first, math.floor(high / step) + 1)]


def trace(title, x_label, lines, x_text="{:g}".format, y_text="{:g}".format):
    """A panel of 640 by 200 pixels: lines of (colour, label, [(x, y)]). `x_text` and `y_text` write the numbers of the axes."""
    left, right, top, bottom = 76, 624, 34, 160
    xs = [x for _, _, points in lines for x, _ in points]
    ys = [y for _, _, points in lines for _, y in points]
    x0, x1, y0, y1 = min(xs), max(xs), min(ys), max(ys)
    pad = 0.06 * (y1 - y0) or 1.0
    y0, y1 = y0 - pad, y1 + pad
    at = lambda x, y: (left + (x - x0) / (x1 - x0) * (right - left), bottom - (y - y0) / (y1 - y0) * (bottom - top))
    text = lambda x, y, s, anchor="start", colour=INK: (
        f'<text x="{x:.0f}" y="{y:.0f}" text-anchor="{anchor}" font-family="DejaVu Sans, Verdana, sans-serif" font-size="13" fill="{colour}">{s}</text>'
    )
    out = [f'<svg width="640" height="200" viewBox="0 0 640 200" role="img" xmlns="http://www.w3.org/2000/svg"><title>{title}</title>',
           '<rect width="640" height="200" fill="#FFFFFF"/>', text(left, 22, title)]
    at_x = right
    for colour, label, _ in reversed([line for line in lines if line[1]]):
        out.append(text(at_x, 22, label, "end", colour))
        at_x -= 8 * len(label) + 12
    for y in ticks(y0, y1):
        _, py = at(x0, y)
        out += [f'<line x1="{left}" x2="{right}" y1="{py:.1f}" y2="{py:.1f}" stroke="#E4E4E4"/>', text(left - 8, py + 5, y_text(y).replace("-", "−"), "end")]
    for x in ticks(x0, x1):
        out.append(text(at(x, y0)[0], bottom + 18, x_text(x), "middle"))
    out.append(text((left + right) / 2, 195, x_label, "middle"))
    for colour, _, points in lines:
        drawn = simplified([at(*p) for p in thinned(points, 500)], 0.3)
        out.append(f'<polyline fill="none" stroke="{colour}" stroke-width="1.2" points="' + " ".join(f"{x:.1f},{y:.1f}" for x, y in drawn) + '"/>')
    out.append(f'<rect x="{left}" y="{top}" width="{right - left}" height="{bottom - top}" fill="none" stroke="#606060"/></svg>')
    return "\n".join(out) + "\n"


def thinned(points, most):
    """At most `most` points: of each stretch the lowest and the highest."""
    if len(points) <= most:
        return points
    size = math.ceil(2 * len(points) / most)
    out = []
    for i in range(0, len(points), size):
        part = sorted(points[i : i + size], key=lambda p: p[1])
        out += sorted({part[0], part[-1]})
    return out


class Pictures:
    def __init__(self, gyroid, place):
        self.gyroid, self.place = gyroid, pathlib.Path(place)
        (self.place / "data").symlink_to(ROOT / "data")

    def run(self, line):
        done = subprocess.run([self.gyroid, *line.split(), "--quiet", "--force"], cwd=self.place, capture_output=True, text=True)
        if done.returncode:
            raise SystemExit(f"gyroid {line}: exit code {done.returncode}\n{done.stderr}")

    def columns(self, config, line):
        (self.place / "sim.toml").write_text(config)
        self.run(f"simulate sim.toml {line} -o log.csv")
        with open(self.place / "log.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        return {name: [float(row[name]) if row[name] else None for row in rows] for name in rows[0]}

    def commands(self):
        rest = (ROOT / "data/truth.toml").read_text().replace('"driving"', '"stationary"')
        rest = re.sub(r"^sample_time_s.*", "sample_time_s = 0.1", rest, flags=re.M)
        (self.place / "sim.toml").write_text(rest)
        (self.place / "real.toml").write_text(rest + "\n" + TONE)
        for name, (lines, part) in COMMANDS.items():
            for line in lines:
                self.run(line.format("picture.svg"))
            self.save(name, slim((self.place / "picture.svg").read_text(), part))

    def rest(self):
        # a room that warms by eight degrees and a supply that sags in steps
        with open(self.place / "inputs.csv", "w") as file:
            file.write("t_s,gyro_z_rad_s,temperature_c,supply_v\n")
            for i in range(18001):
                t = 0.1 * i
                file.write(f"{t:.1f},0.001,{24 - 4 * math.cos(2 * math.pi * t / 1800):.4f},{5.0 - 0.06 * (int(t / 300) % 2):.3f}\n")
        for name, (parameters, length, readings) in REST.items():
            effect = f'[[effect]]\nid = "{name}"\n{parameters}\n'
            without, with_it = (self.columns(REST_SIMULATOR + e, "--inputs inputs.csv --seed 7") for e in ("", effect))
            t, a, b = without["t_s"], without["gyro_z_rad_s"], with_it["gyro_z_rad_s"]
            n = round(length / 0.1) + 1
            minutes = length > 300
            x = [v / 60 if minutes else v for v in t[:n]]
            label = "time, min" if minutes else "time, s"
            if readings:
                pairs = [(BLUE, "with it", b), (GREY, "without", a)]
                lines = [(c, l, list(zip(x, (1e3 * v for v in values[:n])))) for c, l, values in (pairs if name != "gyro.bandwidth" else pairs[::-1])]
                self.save(f"effects/rest_{name}", trace("readings, mrad/s", label, lines))
            else:
                added = [1e3 * (q - p) for p, q in zip(a[:n], b[:n])]
                self.save(f"effects/rest_{name}", trace("what it adds, mrad/s", label, [(BLUE, "", list(zip(x, added)))]))

    def drives(self):
        base = (ROOT / "data/truth.toml").read_text().replace("rate_hz = 5.0", "rate_hz = 50.0")
        for name, parameters in DRIVE.items():
            effect = f'\n[[effect]]\nid = "{name}"\n{parameters}\n'
            # the torques of a drive along eights, replayed
            line = "--inputs data/drives/rover_fit.parquet --seed 7"
            without, with_it = (self.columns(base + e, line) for e in ("", effect))
            best = None
            for columns, noise, label, scale in SHOWN:
                lines, size = [], 0.0
                for column, colour in zip(columns, (BLUE, ORANGE)):
                    rows = [(t, scale * (q - p)) for t, p, q in zip(without["t_s"], without[column], with_it[column]) if p is not None and q is not None]
                    size = max(size, math.sqrt(sum(y * y for _, y in rows) / len(rows)) / (noise * scale))
                    short = {"wheel_left_rad_s": "left", "wheel_right_rad_s": "right", "x_m": "x", "y_m": "y"}.get(column, "")
                    lines.append((colour, short, rows))
                if best is None or size > best[0]:
                    best = (size, label, lines)
            self.save(f"effects/drive_{name}", trace(f"what it changes: {best[1]}", "time, s", best[2]))

    def live(self):
        """Latency and loss of the live node, as tests/ros/check.py measured them into data/live.json."""
        found = json.loads((ROOT / "data/live.json").read_text())
        power = lambda x: f"{10.0**x:.2g}"
        pairs = [(GREY, "Cyclone DDS to itself", "the same without the node"), (BLUE, "through the node", "latency at 1 kHz")]
        every = [(colour, label, found[name]["counts"]) for colour, label, name in pairs]
        edges = found["latency at 1 kHz"]["edges_log10_ms"]
        heard = [i for i in range(len(edges) - 1) if any(counts[i] for _, _, counts in every)]
        # a bin without a message lies at the lower edge
        least = 0.1 / max(sum(counts) for _, _, counts in every)
        lines = []
        for colour, label, counts in every:
            shares = [(i, math.log10(100 * max(counts[i] / sum(counts), least))) for i in range(heard[0], heard[-1] + 1)]
            lines.append((colour, label, [(edges[i + end], share) for i, share in shares for end in (0, 1)]))
        self.save("live_latency", trace("messages, %", "latency, ms", lines, power, power))
        lost = found["lost of each 1000 of a storm"]
        steps = [(i + end, n / 10) for i, n in enumerate(lost) for end in (0, 1)]
        self.save("live_storm", trace("lost, %", "thousands sent", [(BLUE, "", steps)]))

    def save(self, name, svg):
        path = OUT / f"{name}.svg"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(svg)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    with tempfile.TemporaryDirectory() as place:
        pictures = Pictures(str(pathlib.Path(sys.argv[1]).absolute()), place)
        pictures.commands()
        pictures.rest()
        pictures.drives()
        pictures.live()
