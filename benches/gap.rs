//! The diagnosis at rest and of drives: seconds of each stage, and the peak of resident memory.
//!
//! `cargo bench --bench gap`: logs at rest of 1e5 and 1e6 samples with one effect, and a drive of 25 000 rows with all
//! channels. Each runs in a process of its own, so that its peak is its own. `-- 100000`, `-- drive` runs only that; `-- drives-100` runs a hundred such drives, each with one or two
//! effects of typical size, and says how long the middle one and the slowest one take; `-- drives-100:15,33` runs only
//! these.

use gyroid::config::{Config, EffectTable};
use gyroid::effects::Library;
use gyroid::effects::drive::{DriveExplanation, Driving, registry};
use gyroid::gap::predictive;
use gyroid::gap::{Drive, Options, Stage, diagnose_drives, diagnose_observed};
use gyroid::signal::Log;
use gyroid::simulate::{self, Course, drive_with, stationary_with};
use std::process::Command;
use std::time::Instant;

const CHILD: &str = "GYROID_BENCH_GAP";
const REST: &str = "schema = 1\nkind = \"stationary\"\nsample_time_s = 0.01\n[gyro]\nc1_rad_s = 2e-3\nc2_rad_s = -3e-3\n\
    time_constant_s = 300.0\nangle_random_walk_rad_sqrt_s = 1e-4\nturn_on_bias_std_rad_s = 2e-4\nwarm_up_relative_std = 0.03\n";

const DRIVE: &str = "drive";
const DRIVES: &str = "drives-";
const DRIVING: &str = include_str!("../tests/common/robot.toml");
/// Rows of a drive, at 100 Hz.
const ROWS: f64 = 25_000.0;

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

fn recordings(which: &str) -> Outcome<(Config, Log, Log)> {
    let rows: f64 = which.parse()?;
    let config = Config::parse(REST, "sim.toml")?;
    let mut real = config.clone();
    let parameters = [("rate_random_walk_rad_s_sqrt_s".to_string(), 5e-6)].into();
    real.effects.push(EffectTable { id: "gyro.rate_random_walk".into(), parameters });
    let log = |seed: u64| stationary_with(&real, 0.01 * rows, &simulate::Options::from(seed), &Library::new());
    Ok((config, log(1)?, log(2)?))
}

/// Peak of resident memory of this process so far, MB; none where the system does not tell.
fn peak_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<f64>().ok()? / 1024.0)
}

/// The stages that have begun, and when.
struct Stages {
    begun: Vec<(&'static str, Instant)>,
    /// Peak of memory before the first one, MB
    made_mb: Option<f64>,
}

impl Stages {
    fn new() -> Self {
        Self { begun: Vec::new(), made_mb: peak_mb() }
    }

    fn begin(&mut self, stage: Stage) {
        let name = match stage {
            Stage::Prepare => "prepare",
            Stage::Compare => "compare effects",
            Stage::Measure => "measure on the log held out",
            Stage::Done => "place in time, frequency, ...",
        };
        self.begun.push((name, Instant::now()));
    }

    fn total_s(&self) -> f64 {
        self.begun[self.begun.len() - 1].1.duration_since(self.begun[0].1).as_secs_f64()
    }

    fn print(&self) {
        let total = self.total_s();
        for pair in self.begun.windows(2) {
            let seconds = pair[1].1.duration_since(pair[0].1).as_secs_f64();
            println!("  {:<32}{seconds:>9.3} s {:>5.1} %", pair[0].0, 100.0 * seconds / total);
        }
        print!("  {:<32}{total:>9.3} s", "all");
        match (self.made_mb, peak_mb()) {
            (Some(made), Some(peak)) => println!("         peak {peak:.0} MB, {made:.0} of it to make the logs"),
            _ => println!(),
        }
    }
}

fn at_rest(which: &str) -> Outcome<()> {
    let (config, fit, hold) = recordings(which)?;
    let (library, mut stages) = (Library::new(), Stages::new());
    let mut observe = |stage| stages.begin(stage);
    let diagnosis = diagnose_observed(&config, &fit, Some(&hold), &library, &Options::default(), &mut observe)?;
    predictive::of_prepared(
        diagnosis.prepared.as_ref().expect("a recording at rest"),
        [&config.effects, &diagnosis.augmented.effects],
        &library,
        1,
    )?;
    stages.begun.push(("", Instant::now()));
    println!("{which}: {} rows, found {:?}", fit.len(), diagnosis.answer.together);
    stages.print();
    Ok(())
}

/// Effects that change the equations, each of half its largest usual size; what it need not state is left to it.
fn typical() -> Vec<EffectTable> {
    let table = |effect: &&'static dyn Driving| {
        let DriveExplanation::Model(law) = effect.explanation() else { return None };
        let mut theta = vec![0.0; law.coordinates().len()];
        theta[0] = 0.5 * law.coordinates()[0].scale[1];
        let about = effect.about();
        let mut parameters = law.parameters(&theta);
        let required = |name: &str| about.parameters.iter().any(|p| p.name == name && p.required);
        if parameters.keys().any(|name| required(name)) {
            parameters.retain(|name, _| required(name));
        }
        Some(EffectTable { id: about.id.into(), parameters })
    };
    registry().iter().filter_map(table).collect()
}

/// The drive number `case`: courses and effects take turns, and every other one has two effects.
fn driven(case: usize) -> Outcome<Stages> {
    let config = Config::parse(DRIVING, "robot.toml")?;
    let (mut real, typical, library) = (config.clone(), typical(), Library::new());
    real.effects.push(typical[case % typical.len()].clone());
    let second = &typical[(7 * case + 3) % typical.len()];
    if case % 2 == 1 && second.id != real.effects[0].id {
        real.effects.push(second.clone());
    }
    let course = [Course::Brisk, Course::Random, Course::Square][case % 3];
    let run = |seed: usize| {
        let options = simulate::Options { vary_turn_on: true, ..(seed as u64).into() };
        drive_with(&real, course, 0.01 * ROWS, &options, &library)
    };
    let [fit, hold] = [run(2 * case + 1)?, run(2 * case + 2)?];
    let ready = |log| Drive::new(log, 0.0);
    let mut stages = Stages::new();
    let mut observe = |stage| stages.begin(stage);
    let options = Options::default();
    let found = diagnose_drives(&config, &[ready(&fit.log)], &[ready(&hold.log)], &library, &options, &mut observe)?;
    let put: Vec<&str> = real.effects.iter().map(|e| e.id.as_str()).collect();
    println!("drive {case}: {} rows, {}; found {:?}", fit.log.len(), put.join(" and "), found.answer.together);
    Ok(stages)
}

fn child(which: &str) -> Outcome<()> {
    if which == DRIVE {
        driven(0)?.print();
        return Ok(());
    }
    let Some(cases) = which.strip_prefix(DRIVES) else { return at_rest(which) };
    let mut seconds = Vec::new();
    let (count, only) = cases.split_once(':').unwrap_or((cases, ""));
    let named: Vec<usize> = only.split(',').filter(|n| !n.is_empty()).map(str::parse).collect::<Result<_, _>>()?;
    let cases = if named.is_empty() { (0..count.parse()?).collect() } else { named };
    for case in cases {
        let taken = driven(case)?.total_s();
        println!("  {taken:.2} s");
        seconds.push(taken);
    }
    seconds.sort_by(f64::total_cmp);
    let [middle, slowest] = [seconds.len() / 2, seconds.len().saturating_sub(1)].map(|at| seconds.get(at));
    if let (Some(middle), Some(slowest)) = (middle, slowest) {
        println!("{} drives: {middle:.2} s in the middle, {slowest:.2} s the slowest", seconds.len());
    }
    Ok(())
}

fn main() -> Outcome<()> {
    if let Ok(which) = std::env::var(CHILD) {
        return child(&which);
    }
    let asked: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let all = ["100000", "1000000", DRIVE].map(String::from).to_vec();
    for which in if asked.is_empty() { all } else { asked } {
        let status = Command::new(std::env::current_exe()?).env(CHILD, &which).status()?;
        if !status.success() {
            return Err(format!("{which}: {status}").into());
        }
    }
    Ok(())
}
