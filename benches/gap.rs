//! The diagnosis at rest: seconds of each stage, and the peak of resident memory.
//!
//! `cargo bench --bench gap`: one case of the generator (two effects, a little of others), and logs of 1e5 and 1e6 samples
//! with one. Each runs in a process of its own, so that its peak is its own. `-- generator`, `-- 100000` runs only that.

use gyroid::config::{Config, EffectTable, Kind};
use gyroid::effects::Library;
use gyroid::gap::{Options, Stage, diagnose_observed, place};
use gyroid::reality::{Spec, Strength, make};
use gyroid::signal::Log;
use gyroid::simulate::{self, stationary_with};
use std::process::Command;
use std::time::Instant;

const CHILD: &str = "GYROID_BENCH_GAP";
const GENERATOR: &str = "generator";
const REST: &str = "schema = 1\nkind = \"stationary\"\nsample_time_s = 0.01\n[gyro]\nc1_rad_s = 2e-3\nc2_rad_s = -3e-3\n\
    time_constant_s = 300.0\nangle_random_walk_rad_sqrt_s = 1e-4\nturn_on_bias_std_rad_s = 2e-4\nwarm_up_relative_std = 0.03\n";

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

fn recordings(which: &str) -> Outcome<(Config, Log, Log)> {
    if which == GENERATOR {
        let effects = vec![("gyro.temperature_sensitivity", Strength::Strong), ("gyro.tone", Strength::Medium)];
        let case = make(Kind::Stationary, 5, 0, &Spec { effects, messy: true })?;
        return Ok((case.config, case.fit, case.hold));
    }
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

fn child(which: &str) -> Outcome<()> {
    let (config, fit, hold) = recordings(which)?;
    let before = peak_mb();
    let library = Library::new();
    let mut begun: Vec<(&str, Instant)> = Vec::new();
    let mut observe = |stage: Stage| {
        let name = match stage {
            Stage::Prepare => "prepare",
            Stage::Compare => "compare effects",
            Stage::Measure => "measure on the log kept back",
            Stage::Done => "place in time, frequency, ...",
        };
        begun.push((name, Instant::now()));
    };
    let diagnosis = diagnose_observed(&config, &fit, Some(&hold), &library, &Options::default(), &mut observe)?;
    place::of_prepared(
        diagnosis.prepared.as_ref().expect("a recording at rest"),
        &diagnosis.augmented.effects,
        &library,
        1,
    )?;
    begun.push(("", Instant::now()));
    let total = begun[begun.len() - 1].1.duration_since(begun[0].1).as_secs_f64();
    println!("{which}: {} rows, found {:?}", fit.len(), diagnosis.answer.together);
    for pair in begun.windows(2) {
        let seconds = pair[1].1.duration_since(pair[0].1).as_secs_f64();
        println!("  {:<32}{seconds:>9.3} s {:>5.1} %", pair[0].0, 100.0 * seconds / total);
    }
    print!("  {:<32}{total:>9.3} s", "all");
    match (before, peak_mb()) {
        (Some(before), Some(peak)) => println!("         peak {peak:.0} MB, {before:.0} of it to make the logs"),
        _ => println!(),
    }
    Ok(())
}

fn main() -> Outcome<()> {
    if let Ok(which) = std::env::var(CHILD) {
        return child(&which);
    }
    let asked: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let all = [GENERATOR, "100000", "1000000"].map(String::from).to_vec();
    for which in if asked.is_empty() { all } else { asked } {
        let status = Command::new(std::env::current_exe()?).env(CHILD, &which).status()?;
        if !status.success() {
            return Err(format!("{which}: {status}").into());
        }
    }
    Ok(())
}
