//! Parts of an answer: parameters with their standard deviations from what was fitted.

use super::nongaussian::amplitude::Amplitude;
use super::nongaussian::repeats::Repeats;
use super::nongaussian::shots::Shots;
use super::nongaussian::telegraph::TelegraphFit;
use super::whittle::evidence::{Fitted, Likelihood};
use super::whittle::hypothesis::{Hypothesis, Kind, SignalPart};
use crate::effects::{Parameters, Signal, by_id};
use crate::gap::selection::leave_out::shares;
use crate::gap::selection::sets::Part;
use crate::model::Scene;
use std::f64::consts::{SQRT_2, TAU};

/// Name of the parameter `i` of the effect `id`, in the order in which its way of explaining has them.
pub(crate) fn name(id: &str, i: usize) -> &'static str {
    by_id(id).map_or("", |e| e.about().name(i))
}

/// The parts of a fitted set.
pub(crate) fn parts(l: &Likelihood, fitted: &Fitted) -> Vec<Part> {
    let h = &fitted.hypothesis;
    let Some(posterior) = l.coefficients(h) else { return Vec::new() };
    let size = posterior.mean.len();
    // other parts have the coefficients that they take without one: of two interchangeable parts neither is indispensable
    let members: Vec<usize> = h.candidates().collect();
    let shares = shares(&members, |keep| l.plug_in(h, keep).unwrap_or(f64::NEG_INFINITY));
    let share = |c: usize| members.iter().position(|m| *m == c).map_or(0.0, |i| shares[i]);
    let mut parts = Vec::new();
    let mut at = size - h.signals.iter().map(|s| s.columns.len()).sum::<usize>();
    for s in &h.signals {
        let c = &l.candidates[s.candidate];
        let mut part = Part::new(&c.id, c.named, share(s.candidate));
        let range = at..at + s.columns.len();
        let mean = &posterior.mean[range.clone()];
        let covariance = |i: usize, j: usize| posterior.covariance[(at + i) * size + at + j];
        match &c.kind {
            Kind::Signal(k) if c.named => signal(&mut part, (l, h), k.as_ref(), s, mean, &covariance, &l.frame.coarse),
            Kind::Line(k, _) if c.named => {
                signal(&mut part, (l, h), k.as_ref(), s, mean, &covariance, &l.frame.scene);
                let f = s.shape.first().copied().unwrap_or(0.0);
                part.frequency_hz = Some([f, f]);
                // Cramér-Rao bound of the frequency (Rife and Boorstyn 1974)
                let gain = part.share.max(1.0);
                part.std.insert(name(&c.id, 0).into(), (6.0 / gain).sqrt() / (TAU * l.frame.scene.span_s()));
            }
            Kind::TurnOn => {
                part.parameters.insert(name(&c.id, 0).into(), mean[0]);
                part.std.insert(name(&c.id, 0).into(), covariance(0, 0).max(0.0).sqrt());
            }
            Kind::Line(..) => {
                let f = s.shape.first().copied().unwrap_or(0.0);
                part.frequency_hz = Some([f, f]);
                part.description =
                    format!("something periodic of no sinusoidal shape: period {:.4} s", 1.0 / f.max(1e-300));
            }
            _ => part.description = describe(&c.id),
        }
        if matches!(&c.kind, Kind::Signal(k) if k.is_event()) {
            let t = s.shape.first().copied().unwrap_or(0.0);
            let blurred = l.frame.coarse.step_s;
            part.time_s = Some([t - blurred, t + blurred]);
        }
        parts.push(part);
        at = range.end;
    }
    let mut at = 1;
    for n in &h.noises {
        let c = &l.candidates[n.candidate];
        let mut part = Part::new(&c.id, c.named, share(n.candidate));
        let std = &fitted.std[at..at + n.ln_theta.len()];
        match &c.kind {
            Kind::Noise(k) | Kind::Filter(k) | Kind::Level(k) if c.named => {
                for ((name, v), s) in k.names().iter().zip(&n.ln_theta).zip(std) {
                    part.parameters.insert((*name).into(), v.exp());
                    part.std.insert((*name).into(), v.exp() * s);
                }
            }
            Kind::Variance(k) if c.named => {
                let scale = l.frame.variance_scales(n.candidate);
                let coefficients: Vec<f64> = n.ln_theta.iter().zip(scale.iter()).map(|(a, s)| a * s).collect();
                part.parameters = k.parameters(&l.frame.coarse, &[], &coefficients);
                for (j, s) in std.iter().enumerate() {
                    let mut moved = coefficients.clone();
                    moved[j] += s * scale[j];
                    spread(&mut part, &k.parameters(&l.frame.coarse, &[], &moved));
                }
                root(&mut part);
            }
            _ => part.description = describe(&c.id),
        }
        parts.push(part);
        at += n.ln_theta.len();
    }
    parts
}

fn describe(id: &str) -> String {
    match id {
        "free.time" => "a smooth function of time that no named effect has",
        "free.temperature" => "a function of temperature that is not close to linear",
        "free.temperature_rate" => "follows the temperature's rate, or its sign",
        "free.supply" => "a function of the supply that is not close to linear",
        "free.supply_rate" => "follows the supply's rate, or its sign",
        "free.variance_time" => "the noise's level changes slowly with time",
        "free.variance_temperature" => "the noise's level follows temperature otherwise than by growth",
        "free.variance_temperature_rate" => "the noise's level follows the temperature's rate",
        "free.variance_supply" => "the noise's level follows the supply",
        "free.variance_supply_rate" => "the noise's level follows the supply's rate",
        "free.spectrum" => "the spectrum has another shape than any named noise gives it",
        _ => "a free form",
    }
    .to_owned()
}

fn spread(part: &mut Part, moved: &Parameters) {
    spread_by(part, moved, 1.0);
}

fn spread_by(part: &mut Part, moved: &Parameters, weight: f64) {
    for (name, v) in moved {
        let d = v - part.parameters.get(name).copied().unwrap_or(*v);
        *part.std.entry(name.clone()).or_default() += weight * d * d;
    }
}

fn root(part: &mut Part) {
    part.std.values_mut().for_each(|v| *v = v.sqrt());
}

/// Parameters of a signal, their standard deviations by differences along the covariance's factor.
fn signal(
    part: &mut Part,
    (l, h): (&Likelihood, &Hypothesis),
    k: &dyn Signal,
    s: &SignalPart,
    mean: &[f64],
    covariance: &dyn Fn(usize, usize) -> f64,
    scene: &Scene,
) {
    let p = mean.len();
    // an insignificant term of higher order would only blur the slope
    let bent = |j: usize| mean[j].abs() > 2.5 * covariance(j, j).max(0.0).sqrt();
    let phases = matches!(l.candidates[s.candidate].kind, Kind::Line(..));
    let kept: Vec<f64> = (0..p).map(|j| if j == 0 || phases || bent(j) { mean[j] } else { 0.0 }).collect();
    let mean = kept.as_slice();
    part.parameters = k.parameters(scene, &s.shape, mean);
    let matrix = nalgebra::DMatrix::from_fn(p, p, covariance);
    if let Some(factor) = matrix.cholesky() {
        for j in 0..p {
            let moved: Vec<f64> =
                (0..p).map(|i| if i == 0 || phases || bent(i) { mean[i] + factor.l()[(i, j)] } else { 0.0 }).collect();
            spread(part, &k.parameters(scene, &s.shape, &moved));
        }
    }
    // coefficients vary with the shape: a longer time constant has a larger amplitude; that of a tone does not depend
    // on its frequency
    let shapes = if phases { Vec::new() } else { l.over_shape(h, s, k) };
    for at in shapes {
        let moved: Vec<f64> = (0..p).map(|j| if mean[j] == 0.0 { 0.0 } else { at.mean[j] }).collect();
        let told = k.parameters(scene, &[at.shape], &moved);
        spread_by(part, &told, at.weight);
    }
    root(part);
}

/// Part for telegraph noise.
pub(crate) fn telegraph(id: &str, found: &TelegraphFit, scene: &Scene, share: f64) -> Part {
    let mut part = Part::new(id, true, share);
    let chain = &found.chain;
    let [low_s, high_s] = [chain.dwell_low, chain.dwell_high].map(|d| d * scene.step_s);
    let [spacing, low, high] = chain.relative_std;
    let mut set = |i: usize, value: f64, std: f64| {
        part.parameters.insert(name(id, i).into(), value);
        part.std.insert(name(id, i).into(), std);
    };
    set(0, chain.spacing, chain.spacing * spacing);
    set(1, 0.5 * (low_s + high_s), 0.5 * (low_s * low).hypot(high_s * high));
    set(2, high_s / low_s, high_s / low_s * low.hypot(high));
    part
}

/// Part for shots that relax.
pub(crate) fn shots(found: &Shots, share: f64) -> Part {
    let mut part = Part::new("free.shots", false, share);
    let Shots { relax_s, every_s, .. } = found;
    part.description =
        format!("leaps at random times, about {every_s:.0} s apart, that relax within about {relax_s:.1} s");
    part
}

/// Part for rare large samples.
pub(crate) fn outliers(id: &str, a: &Amplitude, white_std_rad_s: f64) -> Part {
    let mut part = Part::new(id, true, a.outliers.max(0.0));
    part.parameters.insert(name(id, 0).into(), a.probability[0]);
    part.std.insert(name(id, 0).into(), a.probability[1]);
    part.parameters.insert(name(id, 1).into(), a.outlier_std * white_std_rad_s);
    part.missed_nats = Some(a.outliers);
    part
}

/// Part for quantization; `named`: id of its effect, none: a free form.
pub(crate) fn lattice(lsb: f64, recorded: &[f64], gain: f64, named: Option<&str>) -> Part {
    let mut part =
        Part { certain: true, ..Part::new(named.unwrap_or("free.lattice"), named.is_some(), gain.max(1e-3)) };
    let step = named.map_or("lsb_rad_s", |id| name(id, 0));
    part.parameters.insert(step.into(), lsb);
    // the step is the span over its count: both ends are off by the rounding of the file
    let [low, high] = recorded.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(*v), b.max(*v)]);
    let off = |v: &f64| ((v - low) / lsb - ((v - low) / lsb).round()) * lsb;
    let rounding = (recorded.iter().map(|v| off(v).powi(2)).sum::<f64>() / recorded.len().max(1) as f64).sqrt();
    let least = f64::EPSILON * low.abs().max(high.abs());
    part.std.insert(step.into(), SQRT_2 * rounding.max(least) / ((high - low) / lsb).round().max(1.0));
    part.description = format!("all values are multiples of {lsb:.6e} rad/s apart");
    part
}

/// Part for exactly equal readings.
pub(crate) fn repeats(r: &Repeats) -> Part {
    let mut part = Part { certain: true, ..Part::new("free.repeats", false, r.ln_evidence) };
    part.description = if r.most > r.held + 2 {
        let what = if r.extreme { "clipped at" } else { "stuck at" };
        format!("{} readings are exactly {:.6e} rad/s: {what} that value", r.most, r.value_rad_s)
    } else {
        format!("{} readings equal the one before exactly: samples are held", r.held)
    };
    part
}
