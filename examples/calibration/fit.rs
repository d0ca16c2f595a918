//! Intervals of the warm-up and of the straight line, false alarms of the tests beside them.

use crate::table::{Claim, Row, counts, inside};
use gyroid::Result;
use gyroid::bias::WarmUp;
use gyroid::identify::{Estimate, Fit, FitOptions, Weighting, fit};
use gyroid::math::random::Stream;
use gyroid::signal::TimeAxis;
use gyroid::validate::{Options, whiteness};
use rayon::prelude::*;

pub const TRUTH: WarmUp = WarmUp { c1_rad_s: 2e-3, c2_rad_s: -5e-3, time_constant_s: 300.0 };
const WHITE_STD_RAD_S: f64 = 3e-4;
/// K L / N up to which the fit spreads the prior of a walk: the square root of the ratios that `identify` tries.
const GREATEST_WALK: f64 = 1778.0;
/// Prior probability of a walk.
const WALK: f64 = 0.3;

/// Seconds of sample time 1 s; `course` (rad/s) with white noise and a walk of K L / N = `walk`.
fn log(seed: u64, len: usize, walk: f64, course: impl Fn(f64) -> f64) -> (TimeAxis, Vec<f64>) {
    let mut draw = Stream::new(seed, 0);
    let step_rad_s = walk * WHITE_STD_RAD_S / len as f64;
    let mut level = 0.0;
    let values = (0..len)
        .map(|i| {
            let y = course(i as f64) + level + WHITE_STD_RAD_S * draw.normal();
            level += step_rad_s * draw.normal();
            y
        })
        .collect();
    (TimeAxis::Uniform { start_s: 0.0, step_s: 1.0, len }, values)
}

/// K L / N of the walk, as the fit expects it beforehand.
fn drawn(seed: u64) -> f64 {
    let mut draw = Stream::new(seed, 1);
    let (there, size) = (draw.uniform() < WALK, draw.uniform());
    if there { GREATEST_WALK.powf(size) } else { 0.0 }
}

struct Scenario {
    name: &'static str,
    seed: u64,
    len: usize,
    walk: fn(u64) -> f64,
    weighting: Weighting,
    note: &'static str,
}

const HIDDEN: &str = "a walk that the log cannot tell from white noise";
const UNSURE: &str = "the log shows the walk, and not its size";

pub fn intervals(logs: u64) -> Result<Vec<Row>> {
    let plain = |name, seed, len, walk, note| Scenario { name, seed, len, walk, weighting: Weighting::Uniform, note };
    let scenarios = [
        plain("white, 6 T", 1_000, 1800, |_| 0.0, "more than 0.95: a walk is allowed for"),
        plain("white, 3 T", 11_000, 900, |_| 0.0, "more than 0.95: a walk is allowed for"),
        plain("a walk as expected beforehand, 6 T", 21_000, 1800, drawn, ""),
        plain("K L / N = 3, 6 T", 31_000, 1800, |_| 3.0, HIDDEN),
        plain("K L / N = 6, 6 T", 41_000, 1800, |_| 6.0, HIDDEN),
        plain("K L / N = 12, 6 T", 51_000, 1800, |_| 12.0, HIDDEN),
        plain("K L / N = 30, 6 T", 61_000, 1800, |_| 30.0, UNSURE),
        plain("K L / N = 60, 6 T", 71_000, 1800, |_| 60.0, UNSURE),
        plain("K L / N = 12, 3 T", 81_000, 900, |_| 12.0, HIDDEN),
        Scenario {
            weighting: Weighting::Walk,
            ..plain("weighed by the walk, K L / N = 60, 6 T", 71_000, 1800, |_| 60.0, UNSURE)
        },
    ];
    let mut rows = Vec::new();
    for scenario in &scenarios {
        let fits = fitted(scenario, logs)?;
        for (j, name) in ["C1", "C2", "T"].into_iter().enumerate() {
            let truth = [TRUTH.c1_rad_s, TRUTH.c2_rad_s, TRUTH.time_constant_s][j];
            let of = |held: &dyn Fn(&Estimate) -> bool| counts(fits.iter().map(|f| Some(held(&estimates(f)[j]))));
            let row = Row::interval(format!("{name}, {}", scenario.name), of(&|e| inside(e.ci95, truth)));
            let width = median(fits.iter().map(|f| width(&estimates(f)[j])));
            let says = if row.consistent() { String::new() } else { format!("; {}", scenario.note) };
            rows.push(row.with_note(if scenario.note.is_empty() {
                String::new()
            } else {
                format!("width {width:.2}{says}")
            }));
            if scenario.seed == 1_000 {
                let white = of(&|e| (e.estimate - truth).abs() <= 1.96 * e.std_white);
                rows.push(Row::interval(format!("{name} ± 1.96 std of white noise, {}", scenario.name), white));
            }
        }
    }
    Ok(rows)
}

fn fitted(scenario: &Scenario, logs: u64) -> Result<Vec<Fit>> {
    let options = FitOptions { weighting: scenario.weighting, ..FitOptions::default() };
    let one = |i: u64| {
        let seed = scenario.seed + i;
        let (time, values) = log(seed, scenario.len, (scenario.walk)(seed), |t| TRUTH.error_rad_s(t));
        fit(&time, &values, &options)
    };
    (0..logs).into_par_iter().map(one).collect()
}

fn estimates(fit: &Fit) -> [Estimate; 3] {
    [fit.c1_rad_s, fit.c2_rad_s, fit.time_constant_s]
}

/// Width of the interval over that of ± 1.96 standard deviations under white noise.
fn width(e: &Estimate) -> f64 {
    (e.ci95[1] - e.ci95[0]) / (2.0 * 1.96 * e.std_white)
}

/// Mean width of the intervals of C1, C2 and T in white noise, over that of ± 1.96 standard deviations.
pub fn white_widths(logs: u64, len: usize) -> Result<[f64; 3]> {
    let scenario = Scenario { name: "", seed: 91_000, len, walk: |_| 0.0, weighting: Weighting::Uniform, note: "" };
    let fits = fitted(&scenario, logs)?;
    Ok([0, 1, 2].map(|j| fits.iter().map(|f| width(&estimates(f)[j])).sum::<f64>() / fits.len() as f64))
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut all: Vec<f64> = values.collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Start and slope of a log that is too short for T.
pub fn line(logs: u64) -> Result<Vec<Row>> {
    const START_RAD_S: f64 = -5e-3;
    const SLOPE_RAD_S2: f64 = 4e-6;
    let one = |i: u64| {
        let (time, values) = log(101_000 + i, 600, 0.0, |t| START_RAD_S + SLOPE_RAD_S2 * t);
        let line = fit(&time, &values, &FitOptions::default())?.line;
        Ok(line.map(|l| [inside(l.start_rad_s.ci95, START_RAD_S), inside(l.slope_rad_s2.ci95, SLOPE_RAD_S2)]))
    };
    let held: Vec<Option<[bool; 2]>> = (0..logs).into_par_iter().map(one).collect::<Result<_>>()?;
    let row = |j: usize, name: &str| {
        let row = Row::interval(name, counts(held.iter().map(|h| h.map(|h| h[j]))));
        if row.consistent() { row } else { row.with_note("more than 0.95: a walk is allowed for") }
    };
    Ok(vec![row(0, "start of the straight line, white"), row(1, "slope of the straight line, white")])
}

/// How often the tests reject what is true.
pub fn tests(logs: u64) -> Result<Vec<Row>> {
    let one = |i: u64| {
        let seed = 111_000 + i;
        let (time, values) = log(seed, 1800, 0.0, |t| TRUTH.error_rad_s(t));
        let found = fit(&time, &values, &FitOptions::default())?;
        let residuals = found.residuals(&time, &values);
        // the level of a permutation test is right with any number of draws
        let options = Options { seed, draws: 199, ..Options::default() };
        let white = whiteness(&time, &residuals, &found.jacobian(&time), &options).white;
        let (time, values) = log(121_000 + i, 1800, 0.0, |_| TRUTH.c2_rad_s);
        Ok([!white, fit(&time, &values, &FitOptions::default())?.warm_up_found()])
    };
    let rejected: Vec<[bool; 2]> = (0..logs).into_par_iter().map(one).collect::<Result<_>>()?;
    let count = |j: usize| counts(rejected.iter().map(|r| Some(r[j])));
    Ok(vec![
        Row::new("white residuals called not white", Claim::Exactly(0.05), count(0)),
        Row::new("a constant called a warm-up", Claim::AtMost(0.05), count(1)),
    ])
}
