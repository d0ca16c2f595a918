//! The commands of the demonstration, and what of their output is shown.

/// One command.
pub(super) struct Step {
    /// Purpose, in a sentence; empty where the one before says it.
    pub why: &'static str,
    /// The command, its words apart by single spaces.
    pub line: &'static str,
    /// Beginnings of the lines that are shown; the others are left out.
    pub shown: &'static [&'static str],
}

pub(super) const STEPS: [Step; 7] = [
    Step {
        why: "A gyro at rest for an hour from power-on. A robot would record this; here it is simulated.",
        line: "gyroid simulate real.toml --duration 3600 --sample-time 0.1 --seed 1 -o power_on.parquet",
        shown: &["power_on.parquet"],
    },
    Step {
        why: "Its warm-up is fitted and validated. The result is a configuration.",
        line: "gyroid fit power_on.parquet --base robot.toml -o gyroid.toml",
        shown: &["FIT FOR USE", "e(t) =", "estimate", "C1 ", "C2 ", "T  ", "noise:", "wrote", "drew"],
    },
    Step {
        why: "Two drives of a robot whose gyro also reads 1.2 % too much. Its configuration does not know that.",
        line: "gyroid simulate withheld.toml --course random --duration 120 --start-offset 20 --seed 2 -o drive1.parquet",
        shown: &["drive1.parquet"],
    },
    Step {
        why: "",
        line: "gyroid simulate withheld.toml --course square --duration 120 --start-offset 20 --seed 3 -o drive2.parquet",
        shown: &["drive2.parquet"],
    },
    Step {
        why: "The navigation filter uses the configuration. It gains much by it, and says that something is not right.",
        line: "gyroid navigate gyroid.toml drive2.parquet --plot before.png",
        shown: &[
            "heading rms",
            "with error model",
            "without error model",
            "zeroed at the start ",
            "NOT FIT FOR USE",
            "drew",
        ],
    },
    Step {
        why: "The cause is looked for on the first drive, and the finding is measured on the second one. gap.html is the page to pass on.",
        line: "gyroid gap diagnose gyroid.toml --fit drive1.parquet --hold drive2.parquet --start-offset 20 \
               --plot gap.png --html gap.html --why why.md --json gap.json --write-sim augmented.toml",
        shown: &[
            "IDENTIFIED",
            "1. Where",
            "channel",
            "it follows",
            "2. Which",
            "gyro scale factor (",
            "reading =",
            "relative",
            "3. How far",
            "on the recording held out",
            "log score",
            "gyro scale factor alone",
            "4. What to do",
            "gyro scale factor:",
            "drew",
            "wrote",
        ],
    },
    Step {
        why: "The same drive with the finding in the filter's model: the gap is closed.",
        line: "gyroid navigate augmented.toml drive2.parquet --plot after.png",
        shown: &["heading rms", "with error model", "without the effects", "drew"],
    },
];

/// Commands to try next.
pub(super) const NEXT: &str = "\
Next, with recordings of your own:
  gyroid inspect LOG                                  what is in a file
  gyroid fit LOG -o gyroid.toml                       a gyro at rest from power-on
  gyroid init --urdf ROBOT.urdf -o robot.toml         a robot's configuration, also from SDF and MJCF
  gyroid gap diagnose gyroid.toml --fit DRIVE         what a drive has that the simulator lacks";
