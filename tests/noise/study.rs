//! How often intervals cover, how the p value is distributed, and what a slope read off the Allan deviation makes of a warm-up.

use crate::logs::{Truth, simulated, time};
use gyroid::identify::terms::{TermOptions, noise_model};
use gyroid::noise::{Deviation, TermKind, allan};
use rayon::prelude::*;
use std::collections::BTreeMap;

fn scenarios() -> Vec<(&'static str, Truth)> {
    let white = Truth::white();
    vec![
        ("N K", Truth { rate_random_walk: 3.5e-6, ..white }),
        ("N K, warm-up", Truth { rate_random_walk: 3.5e-6, warm_up: Some([2e-3, 500.0]), ..white }),
        ("Q N K", Truth { quantization: 5.8e-5, rate_random_walk: 3.5e-6, ..white }),
        ("N B", Truth { bias_instability: 4e-5, ..white }),
        ("N GM", Truth { gauss_markov: 1.1e-4, correlation_time_s: 10.0, ..white }),
    ]
}

struct Tally {
    logs: usize,
    right_set: usize,
    /// By term: intervals, those that cover.
    covered: BTreeMap<String, [usize; 2]>,
    p_values: Vec<f64>,
}

fn tally(truth: &Truth, logs: u64, draws: usize) -> Tally {
    let one = |seed: u64| {
        // drawn logs of their own for each: else all p values would share the luck of one set
        let options = TermOptions { draws, seed, per_decade: 1, ..TermOptions::default() };
        let model = noise_model(&time(truth), &simulated(truth, 1000 + seed), None, &options).unwrap();
        let mut rows = Vec::new();
        for t in model.terms.iter().filter(|t| truth.size(t.id) > 0.0) {
            let inside = |ci: [f64; 2], v: f64| ci[0] <= v && v <= ci[1];
            rows.push((t.id.id().to_string(), inside(t.ci95, truth.size(t.id))));
            if let Some(c) = t.correlation_time_s {
                rows.push(("correlation_time".into(), inside(c.ci95, truth.correlation_time_s)));
            }
        }
        let kinds: Vec<TermKind> = model.terms.iter().map(|t| t.id).collect();
        (kinds == truth.kinds(), rows, model.goodness.p_value)
    };
    let results: Vec<_> = (0..logs).into_par_iter().map(one).collect();
    let mut out = Tally { logs: logs as usize, right_set: 0, covered: BTreeMap::new(), p_values: Vec::new() };
    for (right, rows, p) in results {
        out.right_set += usize::from(right);
        out.p_values.push(p);
        for (name, inside) in rows {
            let count = out.covered.entry(name).or_default();
            count[0] += 1;
            count[1] += usize::from(inside);
        }
    }
    out
}

impl Tally {
    fn all(&self) -> [usize; 2] {
        self.covered.values().fold([0, 0], |a, c| [a[0] + c[0], a[1] + c[1]])
    }

    /// Largest distance of the p values' distribution from the uniform one.
    fn kolmogorov(&self) -> f64 {
        let mut p = self.p_values.clone();
        p.sort_by(f64::total_cmp);
        let n = p.len() as f64;
        p.iter()
            .enumerate()
            .map(|(i, p)| (p - i as f64 / n).abs().max((p - (i + 1) as f64 / n).abs()))
            .fold(0.0, f64::max)
    }

    fn print(&self, name: &str) {
        let share = |c: &[usize; 2]| 100.0 * c[1] as f64 / c[0].max(1) as f64;
        println!("{name}: {} logs, right set {:.1} %", self.logs, 100.0 * self.right_set as f64 / self.logs as f64);
        for (term, c) in &self.covered {
            println!("  {term:<20} {:>5} intervals, {:.1} % cover", c[0], share(c));
        }
        let low = self.p_values.iter().filter(|p| **p <= 0.05).count() as f64 / self.logs as f64;
        println!("  p values: {:.1} % below 0.05, distance from uniform {:.3}", 100.0 * low, self.kolmogorov());
    }
}

#[test]
#[ignore = "battery: noise models of some logs"]
fn battery_intervals_cover_on_a_few_logs() {
    let mut all = [0, 0];
    for (name, truth) in scenarios().into_iter().take(2) {
        let t = tally(&Truth { samples: 8192, step_s: 0.4, ..truth }, 40, 19);
        t.print(name);
        let c = t.all();
        all = [all[0] + c[0], all[1] + c[1]];
    }
    assert_honest(all[1] as f64 / all[0] as f64, all[0]);
}

/// 95 % within three binomial standard deviations, and a point for what is only asymptotic.
#[track_caller]
fn assert_honest(share: f64, intervals: usize) {
    let std = (0.95 * 0.05 / intervals as f64).sqrt();
    assert!((share - 0.95).abs() < 3.0 * std + 0.01, "{share} of {intervals}");
}

#[test]
#[ignore = "battery: 400 logs of each of five noises"]
fn battery_of_intervals() {
    let logs = crate::cases::cases(400);
    let mut all = [0, 0];
    for (name, truth) in scenarios() {
        let t = tally(&truth, logs, 39);
        t.print(name);
        let c = t.all();
        all = [all[0] + c[0], all[1] + c[1]];
        // uniform p values: the quantile 0.999 of Kolmogorov's distance, and the steps of 1/40
        assert!(t.kolmogorov() < 1.95 / (logs as f64).sqrt() + 1.0 / 40.0, "{name}: {}", t.kolmogorov());
    }
    let share = all[1] as f64 / all[0] as f64;
    println!("all terms: {:.1} % of {} intervals cover", 100.0 * share, all[0]);
    assert_honest(share, all[0]);
}

/// K as tools read it off the Allan deviation: a line of slope ½ on log-log paper by least squares, its value at 3 s.
/// allan_variance_ros lays it through all averaging times; `from_s` cuts off those before the deviation rises.
fn by_slope(points: &[(f64, f64)], from_s: f64) -> f64 {
    let kept: Vec<_> = points.iter().filter(|p| p.0 >= from_s).collect();
    let intercept = kept.iter().map(|(tau, sigma)| sigma.ln() - 0.5 * tau.ln()).sum::<f64>() / kept.len() as f64;
    (intercept + 0.5 * 3f64.ln()).exp()
}

/// Errors of K over `logs` logs: ours, by the slope through all averaging times, by the slope where it rises.
fn errors_of_the_walk(logs: u64) -> [f64; 3] {
    // three hours, C1 = 2e-3 rad/s, T = 600 s
    let truth = Truth {
        samples: 108_000,
        angle_random_walk: 1.7e-4,
        rate_random_walk: 2e-6,
        warm_up: Some([2e-3, 600.0]),
        ..Truth::white()
    };
    let options = TermOptions { draws: 1, per_decade: 1, ..TermOptions::default() };
    let one = |seed: u64| {
        let rates = simulated(&truth, 5000 + seed);
        let model = noise_model(&time(&truth), &rates, None, &options).unwrap();
        // where no walk is found, none is reported
        let ours = model.term(TermKind::RateRandomWalk).map_or(0.0, |t| t.estimate);
        let grid: Vec<usize> = (1..=200).map(|i| i * 50).collect();
        let points = allan::deviations(&rates, truth.step_s, &grid, Deviation::Overlapping);
        let points: Vec<(f64, f64)> = points.iter().map(|p| (p.tau_s, p.deviation_rad_s)).collect();
        let lowest = points.iter().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap().0;
        [ours, by_slope(&points, 0.0), by_slope(&points, lowest)].map(|k| (k - truth.rate_random_walk).powi(2))
    };
    let all: Vec<[f64; 3]> = (0..logs).into_par_iter().map(one).collect();
    std::array::from_fn(|i| (all.iter().map(|e| e[i]).sum::<f64>() / logs as f64).sqrt())
}

#[test]
fn the_walk_under_a_warm_up_is_ten_times_closer_than_a_slope_reads_it() {
    let [ours, all, rising] = errors_of_the_walk(8);
    println!(
        "error of K: ours {ours:.2e}, slope {all:.2e}, slope where it rises {rising:.2e}: {:.0} times",
        all.min(rising) / ours
    );
    assert!(10.0 * ours < all.min(rising), "{ours} {all} {rising}");
}
