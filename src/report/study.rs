//! The report of a study: tables for a terminal, JSON, the page `report.md`, and its figures.

mod claims;
mod figures;
mod page;

use super::FitReport;
use super::numbers::significant;
use crate::study::{
    Belief, Comparison, Estimator, EstimatorResult, Ground, Nees, QUANTITIES, RunCount, Setup, Study, convergence,
};
use crate::units::{RAD_S_PER_DEG_S, duration_text};
use serde_json::{Value, json};
use std::fmt::Write;

/// A study, and the further runs of its report.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct StudyReport {
    /// Setup of the study.
    pub setup: Setup,
    /// Name of the configuration.
    pub robot: String,
    /// Name of the ground.
    pub ground: String,
    /// The gyro's error model, identified from a log at rest: the paper's figure 2.
    pub identification: FitReport,
    /// The runs.
    pub study: Study,
    /// More runs of the same, for the convergence; `None` where the study's own are enough.
    pub longer: Option<Study>,
    /// The study on every ground; empty where that was not asked for.
    pub grounds: Vec<Ground>,
    /// The study with a filter that is wrong about traction; empty where that was not asked for.
    pub beliefs: Vec<Belief>,
}

/// Estimators that the paper has, or that every user has.
const MAIN: [Estimator; 3] = [Estimator::Slip, Estimator::Rolling, Estimator::DeadReckoning];

impl StudyReport {
    /// How the RMS of an estimator settles with the number of runs.
    #[must_use]
    pub(crate) fn convergence(&self, estimator: Estimator) -> Vec<RunCount> {
        convergence(self.longer.as_ref().unwrap_or(&self.study), estimator)
    }

    /// The filter with slip against that without.
    fn slip_against_rolling(&self) -> Option<Comparison> {
        self.study.compare(Estimator::Slip, Estimator::Rolling)
    }

    /// Part of the runs in which the filter with slip is nearer than that without in x, y and heading alike; zero
    /// where one of them did not run.
    #[must_use]
    pub(crate) fn won_in_all(&self) -> f64 {
        let [slip, rolling] = Estimator::FILTERS.map(|e| self.study.of(e).map_or(&[][..], |e| &e.run_rms));
        let won = slip.iter().zip(rolling).filter(|(s, r)| s.iter().zip(*r).all(|(s, r)| s < r)).count();
        won as f64 / slip.len().max(1) as f64
    }

    /// Part of the times of the example run at which the true slips lie within two standard deviations of the
    /// estimated ones; `None` where there are no slips.
    #[must_use]
    pub(crate) fn slips_inside_two_std(&self) -> Option<f64> {
        let example = self.study.example.as_ref()?;
        let both = || example.true_slips.iter().zip(&example.slips).flat_map(|(t, e)| t.iter().zip(e));
        let inside = both().filter(|(truth, [estimate, std])| (estimate - *truth).abs() <= 2.0 * std).count();
        let all = both().count();
        (all > 0).then(|| inside as f64 / all as f64)
    }

    /// Largest slip, in size, of the example run.
    #[must_use]
    pub(crate) fn largest_slip(&self) -> Option<f64> {
        let slips = self.study.example.as_ref()?.true_slips.iter().flatten();
        slips.map(|s| s.abs()).max_by(f64::total_cmp)
    }

    /// The study in a line.
    #[must_use]
    pub(crate) fn heading(&self) -> String {
        let s = &self.setup;
        format!(
            "{} runs of {} on {}, course {}, from {} after power-on, seed {}",
            s.runs,
            duration_text(s.duration_s),
            self.ground.replace('_', " "),
            s.course.name().replace('_', " "),
            duration_text(s.since_power_on_s),
            s.seed
        )
    }

    /// The tables for a terminal.
    #[must_use]
    pub(crate) fn text(&self) -> String {
        // writing to a String cannot fail
        let mut out = String::new();
        let _ = writeln!(out, "{}: {}\n", self.robot, self.heading());
        let _ = writeln!(
            out,
            "{:<42}{:>11}{:>11}{:>11}   {:>9}{:>14}{:>8}",
            "root mean square error", "x", "y", "heading", "NEES", "inside 95 %", "NIS"
        );
        for e in &self.study.estimators {
            let [x, y, heading] = e.rms;
            let _ = write!(
                out,
                "{:<42}{:>9} m{:>9} m{:>9} °",
                e.estimator.words(),
                significant(x, 3),
                significant(y, 3),
                significant(heading / RAD_S_PER_DEG_S, 3)
            );
            let _ = match (&e.nees, e.nis_mean) {
                (Some(nees), Some(nis)) => writeln!(
                    out,
                    "   {:>9}{:>12} %{:>8}",
                    significant(nees.mean, 3),
                    significant(100.0 * nees.inside, 3),
                    significant(nis, 3)
                ),
                _ => writeln!(out),
            };
        }
        let _ = writeln!(out, "\n{:<42}{:>25}{:>25}{:>25}", "factor between errors (95 %)", "x", "y", "heading");
        for (_, words, c) in self.comparisons() {
            let cell = |i: usize| factor(c.factor[i], c.factor_ci95[i]);
            let _ = writeln!(out, "{words:<42}{:>25}{:>25}{:>25}", cell(0), cell(1), cell(2));
        }
        if let Some(c) = self.slip_against_rolling() {
            let [x, y, heading] = c.won.map(|w| significant(100.0 * w, 3));
            let _ = write!(
                out,
                "\nthe filter with slip is nearer in x, y, heading in {x} %, {y} %, {heading} % of the runs, in all three \
                 in {} %",
                significant(100.0 * self.won_in_all(), 3)
            );
        }
        out
    }

    /// Comparisons of two estimators, as far as both ran: id, words, numbers.
    pub(super) fn comparisons(&self) -> Vec<(&'static str, &'static str, Comparison)> {
        use Estimator::*;
        let all = [
            ("slip_against_rolling", "without slip / with slip", Slip, Rolling),
            ("slip_against_dead_reckoning", "encoders alone / with slip", Slip, DeadReckoning),
            ("slip_against_unscented", "on sigma points / with slip", Slip, SlipUnscented),
            ("error_model_slip", "with slip: without / with error model", Slip, SlipWithoutErrorModel),
            ("error_model_rolling", "without slip: without / with error model", Rolling, RollingWithoutErrorModel),
            ("error_model_gyro_raw", "gyro alone: raw / less error model", GyroReckoningModelled, GyroReckoning),
            (
                "error_model_gyro_zeroed",
                "gyro alone: zeroed / less error model",
                GyroReckoningModelled,
                GyroReckoningZeroed,
            ),
        ];
        let compare = |(id, words, this, other)| Some((id, words, self.study.compare(this, other)?));
        all.into_iter().filter_map(compare).collect()
    }

    /// The documented JSON of `gyroid study --json`.
    #[must_use]
    pub(crate) fn json(&self) -> Value {
        let s = &self.setup;
        let mut value = json!({
            "runs": s.runs,
            "seed": s.seed,
            "duration_s": s.duration_s,
            "since_power_on_s": s.since_power_on_s,
            "sample_time_s": s.truth.sample_time_s,
            "course": s.course.name(),
            "ground": self.ground,
            "configuration": self.robot,
            "traction": s.truth.traction,
        });
        let results = results_json(&self.study);
        merge(&mut value, results);
        value["won_in_all_three"] = json!(self.won_in_all());
        value["factors"] = self.comparisons().into_iter().map(|(id, _, c)| (id, comparison_json(&c))).collect();
        value["over_time"] = json!({
            "time_s": self.study.times_s,
            "rms": by_estimator(&self.study, |e| Some(by_quantity(&e.rms_over_time))),
            "nees": by_estimator(&self.study, |e| e.nees.as_ref().map(|n| json!(n.over_time))),
        });
        value["example"] = self.example_json();
        value["identification"] = self.identification_json();
        value["convergence"] = MAIN.into_iter().map(|e| (e.id(), self.convergence_json(e))).collect();
        value["grounds"] = self
            .grounds
            .iter()
            .map(|g| {
                let mut point = json!({
                    "surface": g.surface.name(), "peak_friction": g.peak_friction, "slip_rms": g.slip_rms,
                });
                merge(&mut point, results_json(&g.study));
                let c = g.study.compare(Estimator::Slip, Estimator::Rolling);
                point["slip_against_rolling"] = c.as_ref().map_or(Value::Null, comparison_json);
                point
            })
            .collect();
        value["wrong_beliefs"] = self
            .beliefs
            .iter()
            .map(|b| {
                json!({
                    "friction_factor": b.friction_factor,
                    "stiffness_factor": b.stiffness_factor,
                    "rms": by_quantity(&b.rms),
                    "nis_mean": b.nis_mean,
                    "slip_against_rolling": comparison_json(&b.against_rolling),
                })
            })
            .collect();
        value["claims"] = self
            .claims()
            .iter()
            .map(|c| json!({ "place": c.place, "says": c.says, "status": c.status.name(), "here": c.here }))
            .collect();
        value
    }

    fn example_json(&self) -> Value {
        let Some(example) = &self.study.example else { return Value::Null };
        let pose = |poses: &[[f64; 3]]| -> Value {
            let columns: [Vec<f64>; 3] = std::array::from_fn(|i| poses.iter().map(|p| p[i]).collect());
            by_quantity(&columns)
        };
        let slip = |wheel: usize| {
            let part = |k: usize| example.slips.iter().map(|s| s[wheel][k]).collect::<Vec<f64>>();
            json!({
                "truth": example.true_slips.iter().map(|s| s[wheel]).collect::<Vec<f64>>(),
                "estimate": part(0),
                "std": part(1),
            })
        };
        json!({
            "time_s": example.times_s,
            "truth": pose(&example.truth),
            "estimates": example.estimates.iter().map(|(e, poses)| (e.id(), pose(poses))).collect::<Value>(),
            "slip_left": slip(0),
            "slip_right": slip(1),
            "slips_inside_two_std": self.slips_inside_two_std(),
        })
    }

    fn identification_json(&self) -> Value {
        let fit = &self.identification.fit;
        let levels: Vec<Value> = self
            .identification
            .validation
            .levels
            .iter()
            .map(|l| {
                json!({
                    "averaging_time_s": l.averaging_time_s,
                    "samples": l.whiteness.samples,
                    "autocorrelation": l.whiteness.autocorrelation,
                    "autocorrelation_bound": l.whiteness.autocorrelation_bound,
                })
            })
            .collect();
        json!({
            "log": self.identification.log.name,
            "parameters": {
                "c1_rad_s": fit.c1_rad_s,
                "c2_rad_s": fit.c2_rad_s,
                "time_constant_s": fit.time_constant_s,
            },
            "white": self.identification.validation.white,
            "joint_p_value": self.identification.validation.joint_p_value,
            "levels": levels,
        })
    }

    fn convergence_json(&self, estimator: Estimator) -> Value {
        let points = self.convergence(estimator);
        points
            .iter()
            .map(|p| json!({ "runs": p.runs, "rms": by_quantity(&p.rms), "rms_ci95": by_quantity(&p.rms_ci95) }))
            .collect()
    }
}

/// JSON of the results that every set of runs has.
fn results_json(study: &Study) -> Value {
    let nees = |n: &Nees| {
        json!({
            "mean": n.mean, "expected": 3, "bounds95": n.bounds95,
            "inside_bounds": n.inside, "above_bounds": n.above,
        })
    };
    json!({
        "rms": by_estimator(study, |e| Some(by_quantity(&e.rms))),
        "rms_ci95": by_estimator(study, |e| Some(by_quantity(&e.rms_ci95))),
        "rms_end": by_estimator(study, |e| Some(by_quantity(&e.rms_end))),
        "nees": by_estimator(study, |e| e.nees.as_ref().map(nees)),
        "nis_mean": by_estimator(study, |e| e.nis_mean.map(|n| json!(n))),
    })
}

fn comparison_json(c: &Comparison) -> Value {
    json!({
        "factor": by_quantity(&c.factor),
        "factor_ci95": by_quantity(&c.factor_ci95),
        "won": by_quantity(&c.won),
    })
}

fn by_estimator(study: &Study, of: impl Fn(&EstimatorResult) -> Option<Value>) -> Value {
    study.estimators.iter().filter_map(|e| Some((e.estimator.id(), of(e)?))).collect()
}

fn by_quantity<T: serde::Serialize>(values: &[T; 3]) -> Value {
    QUANTITIES.iter().zip(values).map(|(name, v)| (*name, json!(v))).collect()
}

fn merge(into: &mut Value, from: Value) {
    if let (Value::Object(into), Value::Object(from)) = (into, from) {
        into.extend(from);
    }
}

/// A factor with its interval: `3.21 (2.90 to 3.55)`.
fn factor(value: f64, [low, high]: [f64; 2]) -> String {
    if low.is_nan() || high.is_nan() {
        return significant(value, 3);
    }
    format!("{} ({} to {})", significant(value, 3), significant(low, 3), significant(high, 3))
}

#[cfg(test)]
mod tests;
