"""Writes unrolled.rs: the rolling filter of eight states without a loop, as one would write it by hand for speed alone.

    python3 benches/filter/unroll.py > benches/filter/unrolled.rs

The same UD algorithm as the library's, for this model, these sensors and short steps only: every term that is zero is
left out, every factor one, every index a number. It is what the library's filter is measured against.
"""

STATES, NOISES = 8, 3
X, Y, HEADING, SPEED, YAW_RATE, ERROR, WARM, LN_T = range(STATES)

# Φ and Γ: where they are not zero, 1 or the name of a variable
PHI = {(i, i): 1 for i in (X, Y, HEADING, WARM, LN_T)}
PHI |= {(SPEED, SPEED): "v_by_v", (YAW_RATE, YAW_RATE): "w_by_w", (HEADING, YAW_RATE): "theta_by_w"}
PHI |= {(i, k): f"{a}_by_{b}" for i, a in ((X, "x"), (Y, "y")) for k, b in ((HEADING, "theta"), (SPEED, "v"), (YAW_RATE, "w"))}
PHI |= {(ERROR, ERROR): "left", (ERROR, WARM): "gone", (ERROR, LN_T): "e_by_t"}
GAMMA = {(i, k): f"{a}_by_{side}" for i, a in ((X, "x"), (Y, "y")) for k, side in ((0, "left"), (1, "right"))}
GAMMA |= {(HEADING, 0): "-theta_by_right", (HEADING, 1): "theta_by_right", (SPEED, 0): "v_by_torque", (SPEED, 1): "v_by_torque"}
GAMMA |= {(YAW_RATE, 0): "-w_by_right", (YAW_RATE, 1): "w_by_right", (ERROR, 2): 1, (WARM, 2): 1}
VARIANCES = ["self.torque_variance", "self.torque_variance", "walk_variance"]


def product(a, b):
    return b if a == 1 else a if b == 1 else f"{a} * {b}"


def total(terms):
    return " + ".join("1.0" if t == 1 else t for t in terms)


def u_name(i, j):
    """Row i, column j of U, stored column by column without the ones."""
    return f"self.u[{j * (j - 1) // 2 + i}]"


def prediction():
    lines = []

    def let(name, value):
        lines.append(f"let {name} = {value};")
        return name

    w = {}
    for k in range(STATES):
        for i in range(STATES):
            terms = [product(PHI[i, m], 1 if m == k else u_name(m, k)) for m in range(k + 1) if (i, m) in PHI]
            if terms:
                w[i, k] = terms[0] if terms == [1] else let(f"w_{i}_{k}", total(terms))
    for (i, k), value in GAMMA.items():
        w[i, STATES + k] = value
    # ln T is a constant: its variance stays
    weights = [let(f"d_{k}", f"self.d[{k}]") for k in range(LN_T)] + [None]
    weights += [let(f"q_{k}", value) for k, value in enumerate(VARIANCES)]
    for j in reversed(range(STATES)):
        sources = [k for k in range(STATES + NOISES) if (j, k) in w]
        if sources == [j] and w[j, j] == 1:
            # a constant: its column of U is Φ's product, and it has no part in the rest
            for i in range(j):
                lines.append(f"{u_name(i, j)} = {w.pop((i, j), '0.0')};")
            continue
        weighted = {k: weights[k] if w[j, k] == 1 else let(f"f_{j}_{k}", product(weights[k], w[j, k])) for k in sources}
        pivot = let(f"p_{j}", total([product(weighted[k], w[j, k]) for k in sources]))
        lines.append(f"self.d[{j}] = {pivot};")
        if j:
            inverse = let(f"r_{j}", f"1.0 / {pivot}")
        for i in range(j):
            shared = [k for k in sources if (i, k) in w]
            if not shared:
                continue
            u = let(f"u_{i}_{j}", f"({total([product(weighted[k], w[i, k]) for k in shared])}) * {inverse}")
            lines.append(f"{u_name(i, j)} = {u};")
            for k in sources:
                part = product(u, w[j, k])
                value = f"-({part})" if (i, k) not in w else f"{'1.0' if w[i, k] == 1 else w[i, k]} - {part}"
                w[i, k] = let(f"w_{i}_{j}_{k}", value)
    return lines


def reading(entries):
    """Update by the sum of the states `entries`, each times its factor (1 or the name of a variable)."""
    lines = []

    def let(name, value):
        lines.append(f"let {name} = {value};")
        return name

    first = min(entries)
    let("residual", "reading - (" + total([product(h, f"self.mean[{i}]") for i, h in entries.items()]) + ")")
    lines.append("let a = r;")
    before, gain = "a", {}
    for j in range(first, STATES):
        f = total([product(h, 1 if i == j else u_name(i, j)) for i, h in entries.items() if i <= j])
        let(f"f_{j}", f if f != "1" else "1.0")
        let(f"v_{j}", f"self.d[{j}] * f_{j}")
        let(f"a_{j}", f"{before} + f_{j} * v_{j}")
        before = f"a_{j}"
    before, inverse = "a", None
    for j in range(first, STATES):
        let(f"r_{j}", f"1.0 / a_{j}")
        lines.append(f"self.d[{j}] *= {before} * r_{j};")
        if gain:
            let(f"l_{j}", f"-f_{j} * {inverse}")
        for i in range(j):
            u = let(f"u_{i}_{j}", u_name(i, j))
            if i in gain:
                lines.append(f"{u_name(i, j)} = {u} + l_{j} * {gain[i]};")
                gain[i] = let(f"g_{i}_{j}", f"{gain[i]} + v_{j} * {u}")
            else:
                gain[i] = let(f"g_{i}_{j}", f"v_{j} * {u}")
        gain[j] = f"v_{j}"
        before, inverse = f"a_{j}", f"r_{j}"
    let("step", f"residual * {inverse}")
    for i in range(STATES):
        lines.append(f"self.mean[{i}] += {gain[i]} * step;")
    return lines


def exponentials(name, rate):
    """exp(-z), φ1(z), φ2(z) at the three nodes and the end of the step."""
    lines = []
    for i, t in enumerate(("t_0", "t_1", "t_2", "dt")):
        p = f"{name}_{i}"
        lines.append(f"let z = {rate} * {t};")
        lines.append(f"let {p}_2 = 0.5 * (1.0 - z * (1.0 / 3.0) * (1.0 - z * 0.25 * (1.0 - z * 0.2 * (1.0 - z * (1.0 / 6.0)))));")
        lines.append(f"let {p}_1 = 1.0 - z * {p}_2;")
        if name == "s" or t == "dt":
            lines.append(f"let {p}_0 = 1.0 - z * {p}_1;")
    return lines


def motion():
    lines = ["let [x, y, theta, v, w, e, s, ln_t] = self.mean;"]
    lines += ["let a = self.a_by_torque * (torques[0] + torques[1]);"]
    lines += ["let alpha = self.alpha_by_torque * (torques[1] - torques[0]);"]
    lines += [f"let t_{i} = {node} * dt;" for i, node in enumerate((0.11270166537925831, 0.5, 0.8872983346207417))]
    lines += exponentials("s", "self.damping") + exponentials("y", "self.yaw_damping")
    for i in range(3):
        lines.append(f"let by_w_{i} = t_{i} * y_{i}_1;")
        lines.append(f"let by_alpha_{i} = t_{i} * t_{i} * y_{i}_2;")
        lines.append(f"let turn_{i} = w * by_w_{i} + alpha * by_alpha_{i};")
    lines.append("let (sin, cos) = (theta + turn_1).sin_cos();")
    for i in (0, 2):
        lines.append(f"let z_{i} = turn_{i} - turn_1;")
        lines.append(f"let q = z_{i} * z_{i};")
        sine, cosine = "(1.0 - q * (1.0 / 110.0))", "(1.0 - q * (1.0 / 132.0))"
        for k in (72, 42, 20, 6):
            sine = f"(1.0 - q * (1.0 / {k}.0) * {sine})"
        for k in (90, 56, 30, 12, 2):
            cosine = f"(1.0 - q * (1.0 / {k}.0) * {cosine})"
        lines.append(f"let aside_{i} = z_{i} * {sine};")
        lines.append(f"let ahead_{i} = {cosine[1:-1]};")
    for i, weight in ((0, "(5.0 / 18.0)"), (1, "(8.0 / 18.0)"), (2, "(5.0 / 18.0)")):
        lines.append(f"let b_{i} = {weight} * dt;")
        lines.append(f"let by_a_{i} = t_{i} * s_{i}_1;")
        lines.append(f"let part_{i} = b_{i} * (v * s_{i}_0 + a * by_a_{i});")
        lines.append(f"let v_{i} = b_{i} * s_{i}_0;")
        lines.append(f"let a_{i} = b_{i} * by_a_{i};")
    ahead, aside = ("ahead_0", 1, "ahead_2"), ("aside_0", None, "aside_2")

    def rotated(name, along, across):
        lines.append(f"let along = {along};")
        lines.append(f"let across = {across};")
        lines.append(f"let x{name} = along * cos - across * sin;")
        lines.append(f"let y{name} = along * sin + across * cos;")

    def straight(term):
        return (
            total([product(term(i), ahead[i]) for i in range(3)]),
            total([product(term(i), aside[i]) for i in range(3) if aside[i]]),
        )

    def turned(factor):
        return (
            "-(" + total([f"part_{i} * {aside[i]} * {factor}_{i}" for i in range(3) if aside[i]]) + ")",
            total([product(f"part_{i} * {factor}_{i}", ahead[i]) for i in range(3)]),
        )

    rotated("_way", *straight(lambda i: f"part_{i}"))
    rotated("_by_v", *straight(lambda i: f"v_{i}"))
    rotated("_by_a", *straight(lambda i: f"a_{i}"))
    rotated("_by_w", *turned("by_w"))
    rotated("_by_alpha", *turned("by_alpha"))
    lines += ["let x_by_theta = -y_way;", "let y_by_theta = x_way;"]
    lines += ["let theta_by_w = dt * y_3_1;", "let theta_by_alpha = dt * dt * y_3_2;"]
    lines += ["let v_by_v = s_3_0;", "let v_by_a = dt * s_3_1;", "let w_by_w = y_3_0;", "let w_by_alpha = theta_by_w;"]
    for name, sign in (("left", "-"), ("right", "+")):
        for axis in "xy":
            lines.append(
                f"let {axis}_by_{name} = {axis}_by_a * self.a_by_torque {sign} {axis}_by_alpha * self.alpha_by_torque;"
            )
    lines.append("let theta_by_right = theta_by_alpha * self.alpha_by_torque;")
    lines.append("let w_by_right = w_by_alpha * self.alpha_by_torque;")
    lines.append("let v_by_torque = v_by_a * self.a_by_torque;")
    lines += ["let rate = (-ln_t).exp();", "let z = rate * dt;"]
    lines.append("let gone = z * (1.0 - z * 0.5 * (1.0 - z * (1.0 / 3.0) * (1.0 - z * 0.25 * (1.0 - z * 0.2))));")
    lines += ["let left = 1.0 - gone;", "let e_by_t = -(s - e) * z * left;", "let walk_variance = self.walk * dt;"]
    after = [
        "x + x_way",
        "y + y_way",
        "theta + w * theta_by_w + alpha * theta_by_alpha",
        "v * v_by_v + a * v_by_a",
        "w * w_by_w + alpha * w_by_alpha",
        "e + gone * (s - e)",
        "s",
        "ln_t",
    ]
    lines.append("self.mean = [" + ", ".join(after) + "];")
    return lines


print(
    """//! The rolling filter of eight states without a loop. Written by `unroll.py`, which says how: not to be edited.

/// Mean, U column by column without its diagonal, D, and the model's numbers.
#[derive(Clone)]
pub struct Unrolled {
    pub mean: [f64; 8],
    pub u: [f64; 28],
    pub d: [f64; 8],
    pub a_by_torque: f64,
    pub alpha_by_torque: f64,
    pub damping: f64,
    pub yaw_damping: f64,
    pub torque_variance: f64,
    pub walk: f64,
    pub gyro_variance: f64,
    pub wheel_variance: f64,
    pub wheel_by_speed: f64,
}

impl Unrolled {""",
    end="",
)


def function(documentation, head, lines):
    print(f"\n    /// {documentation}\n    #[rustfmt::skip]\n    pub fn {head} {{")
    row = ""
    for line in lines:
        if row and len(row) + len(line) > 110:
            print(f"        {row}")
            row = ""
        row += (" " if row else "") + line
    print(f"        {row}\n    }}")


function(
    "Takes in a reading of the gyro.",
    "gyro(&mut self, reading: f64)",
    ["let r = self.gyro_variance;"] + reading({YAW_RATE: 1, ERROR: 1}),
)
function(
    "Takes in a reading of a wheel; `by_yaw_rate` is negative on the left.",
    "wheel(&mut self, reading: f64, by_yaw_rate: f64)",
    ["let (r, by_speed) = (self.wheel_variance, self.wheel_by_speed);"]
    + reading({SPEED: "by_speed", YAW_RATE: "by_yaw_rate"}),
)
function(
    "A step of `dt` seconds; damping times that must be below 0.001, and the turn below 0.5 rad.",
    "predict(&mut self, torques: [f64; 2], dt: f64)",
    motion() + prediction(),
)
print("}")
