//! Floor 3: the fit of e(t) = C1 (1 - exp(-t/T)) + C2 to a log at rest, and of the same error by temperature.
//!
//! Least squares by variable projection: for given T the model is linear, so T alone is searched, over all scales
//! and from no starting value. The covariance allows for a random walk of the bias ([`NoiseEstimate`]), and so do the
//! intervals, which are those of the profile likelihood. Where the residuals show a walk, squares weighed by it
//! ([`Weighting`]) are told beside the plain ones, and may be asked for.

mod advice;
mod compare;
mod minimum;
mod noise;
mod options;
mod profile;
mod projection;
mod reach;
mod robust;
mod search;
mod surface;
mod temperature;
pub mod terms;
mod types;
mod weighted;

pub use advice::Advice;
pub use compare::{Comparison, GainTest, Score};
pub use minimum::Termination;
pub use options::{FitOptions, Fixed, Loss, Weighting};
pub use temperature::{TemperatureFit, fit_temperature, fit_temperature_reduced};
pub use types::{Estimate, Fit, NoiseEstimate, StraightLine};

use crate::bias::WarmUp;
use crate::error::{Error, ErrorKind, Result};
use crate::signal::{Moments, Reduced, TimeAxis};
use minimum::Minimum;
use nalgebra::{DMatrix, Matrix3};
use noise::NoiseFit;
use projection::Projection;
use reach::Reach;
use search::pivot;
use surface::Surface;
use terms::plateau::{Plateau, plateau, plateau_reduced};

const LEVEL: f64 = 0.95;

/// Fits the warm-up model to `values` (rad/s) at `time` (s since power-on).
///
/// # Errors
/// [`ErrorKind::TooShort`] with no more samples than free parameters, [`ErrorKind::Value`] on a value that is not
/// finite or a constant signal, [`ErrorKind::Time`] if times do not increase, [`ErrorKind::Usage`] if nothing is free
/// or a fixed value is not physical.
pub fn fit(time: &TimeAxis, values: &[f64], options: &FitOptions) -> Result<Fit> {
    let free = check_options(&options.fixed)?;
    if values.len() < free + 1 || values.len() < 3 {
        let found = format!("{} samples for {free} free parameters", values.len());
        return Err(Error::new(ErrorKind::TooShort, "log", found).hint("record a longer log, or fix a parameter"));
    }
    let moments = Moments::new(time, values)?;
    check_spread(&moments, values[0])?;
    match options.loss {
        Loss::Squares => solve(&moments, || difference_variance(values), options),
        Loss::Huber => huber(&moments, time, values, options),
    }
    .map(|fit| of_plateau(fit, |fit| plateau(time, values, fit)))
}

/// The fit with N of the plateau, where a low-pass or a vibration shows, and with these.
fn of_plateau(mut fit: Fit, plateau: impl Fn(&Fit) -> Option<Plateau>) -> Fit {
    if let Some(plateau) = plateau(&fit) {
        let other = fit.other_weighting.take().map(|other| Box::new(coloured(*other, &plateau)));
        fit = Fit { other_weighting: other, ..coloured(fit, &plateau) };
    }
    fit
}

fn coloured(mut fit: Fit, plateau: &Plateau) -> Fit {
    fit.noise.angle_random_walk_rad_sqrt_s = plateau.angle_random_walk_rad_sqrt_s;
    Fit { colour: plateau.colour.clone(), ..fit }
}

/// Fits the warm-up model to a log of which one pass kept the moments; its times count from power-on.
///
/// # Errors
/// As [`fit`]; [`ErrorKind::Usage`] for a loss other than least squares, which looks at the samples again and again.
pub fn fit_reduced(log: &Reduced, options: &FitOptions) -> Result<Fit> {
    let free = check_options(&options.fixed)?;
    if options.loss != Loss::Squares {
        return Err(Error::new(ErrorKind::Usage, "--loss", "a robust loss needs all samples at once, several times")
            .hint("use the default loss, or raise --memory so that the log is held"));
    }
    let moments = &log.moments;
    if moments.count < (free + 1).max(3) {
        let found = format!("{} samples for {free} free parameters", moments.count);
        return Err(Error::new(ErrorKind::TooShort, "log", found).hint("record a longer log, or fix a parameter"));
    }
    check_spread(moments, moments.reference)?;
    let fit = solve(moments, || log.difference_variance, options)?;
    Ok(of_plateau(fit, |fit| plateau_reduced(log, fit)))
}

fn check_spread(moments: &Moments, value: f64) -> Result<()> {
    let spread =
        moments.square_sum - moments.blocks.iter().map(|b| b.moments[0]).sum::<f64>().powi(2) / moments.count as f64;
    if spread > f64::EPSILON.powi(2) * moments.reference.powi(2) * moments.count as f64 {
        return Ok(());
    }
    Err(Error::new(ErrorKind::Value, "log", format!("all samples are {value}"))
        .hint("a gyro at rest is never constant: check that the sensor is on, and the column"))
}

/// Half the mean square of successive differences.
fn difference_variance(values: &[f64]) -> f64 {
    let squares: f64 = values.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum();
    0.5 * squares / (values.len() - 1) as f64
}

fn check_options(fixed: &Fixed) -> Result<usize> {
    let given = [fixed.c1_rad_s, fixed.c2_rad_s, fixed.time_constant_s];
    for (name, value) in ["c1", "c2", "time constant"].iter().zip(given) {
        let bad = value.is_some_and(|v| !v.is_finite() || (*name == "time constant" && v <= 0.0));
        if bad {
            let found = format!("{} is not a physical value for the {name}", value.unwrap_or(f64::NAN));
            return Err(Error::new(ErrorKind::Usage, "fixed parameter", found));
        }
    }
    match given.iter().filter(|v| v.is_none()).count() {
        0 => Err(Error::new(ErrorKind::Usage, "fixed parameters", "all are given, and nothing is left to fit")
            .hint("free one, or validate the model with gyroid validate")),
        free => Ok(free),
    }
}

/// Iterations of Huber's method at most; it converges linearly with the share of samples that are bent.
const HUBER_STEPS: usize = 60;

fn huber(first: &Moments, time: &TimeAxis, values: &[f64], options: &FitOptions) -> Result<Fit> {
    let least_squares = |moments: &Moments| {
        let projection = Projection::new(moments, &options.fixed);
        power_on(&projection, &search::minimum(&projection, options.fixed.time_constant_s))
    };
    let mut model = least_squares(first);
    let mut previous = f64::INFINITY;
    for _ in 0..HUBER_STEPS {
        let (r, scale) = robust::residuals(time, values, &model);
        if !(scale > 0.0) {
            return Err(Error::new(ErrorKind::Numeric, "log", "more than half of the samples are the same")
                .at("--loss huber")
                .hint("use the default loss"));
        }
        let replaced = robust::replaced(time, &model, &r, scale);
        let moments = Moments::new(time, &replaced)?;
        let next = least_squares(&moments);
        let moved = (0..8)
            .map(|i| moments.first_s + moments.span_s * f64::from(i) / 7.0)
            .map(|t| (next.error_rad_s(t) - model.error_rad_s(t)).abs())
            .fold(0.0, f64::max);
        model = next;
        // below a millionth of the noise nothing changes that anyone could see
        if moved < 1e-6 * scale / (values.len() as f64).sqrt() || moved >= previous {
            break;
        }
        previous = moved;
    }
    let (r, scale) = robust::residuals(time, values, &model);
    let replaced = robust::replaced(time, &model, &r, scale);
    let moments = Moments::new(time, &replaced)?;
    let mut fit = solve(&moments, || difference_variance(&replaced), options)?;
    fit.loss = Loss::Huber;
    let rss: f64 = fit.residuals(time, values).iter().map(|r| r * r).sum();
    fit.residual_sum_of_squares_rad2_s2 = rss;
    Ok(fit)
}

/// The minimum as a model that counts from power-on.
fn power_on(p: &impl Surface, min: &Minimum) -> WarmUp {
    let e = (p.clock_s() / min.time_constant).exp();
    let c2 = min.linear.c2 + p.reference();
    WarmUp { c1_rad_s: e * min.linear.c1, c2_rad_s: c2 + (1.0 - e) * min.linear.c1, time_constant_s: min.time_constant }
}

/// d(C1, C2, T at power-on) / d(c1, c2, T in the projection's clock).
fn to_power_on(p: &impl Surface, c1: f64, time_constant: f64) -> Matrix3<f64> {
    let x = p.clock_s() / time_constant;
    let e = x.exp();
    let by_t = -c1 * e * x / time_constant;
    #[rustfmt::skip]
    let a = Matrix3::new(
        e,       0.0, by_t,
        1.0 - e, 1.0, -by_t,
        0.0,     0.0, 1.0,
    );
    a
}

/// Fit by least squares, everything included; `by_differences` is the variance that successive differences show.
fn solve(moments: &Moments, by_differences: impl Fn() -> f64, options: &FitOptions) -> Result<Fit> {
    let p = Projection::new(moments, &options.fixed);
    let given_t = options.fixed.time_constant_s;
    let plain = search::minimum(&p, given_t);
    let singular = || {
        Error::new(ErrorKind::Numeric, "log", "the parameters cannot be told apart on these samples")
            .hint("record a longer log, or fix a parameter with --fix")
    };
    let noise = plain_noise(&p, &plain, given_t.is_none()).ok_or_else(singular)?;
    let asked = options.weighting == Weighting::Walk;
    let weighed = if asked || noise.walk_probability() > 0.5 { weighted::fit(&p, given_t) } else { None };
    let context = Context {
        p: &p,
        free_t: given_t.is_none(),
        by_differences: &by_differences,
        comparison: compare::compare(&p, given_t.is_none()),
        line: straight_line(moments, options),
    };
    let reach = Reach::new(&p, &plain, pivot(&p, &plain, given_t.is_none()), &noise);
    let uniform = complete(&context, &p, &plain, &noise, &reach, Weighting::Uniform);
    let Some(w) = weighed else { return Ok(uniform) };
    let walk = complete(&context, &w.surface, &w.minimum, &w.noise, &Reach::alike(), Weighting::Walk);
    let (mut fit, other) = if asked { (walk, uniform) } else { (uniform, walk) };
    fit.other_weighting = Some(Box::new(other));
    Ok(fit)
}

/// Inputs that the fits with both weightings share.
struct Context<'a, 'm> {
    p: &'a Projection<'m>,
    free_t: bool,
    /// The variance that successive differences show, rad²/s².
    by_differences: &'a dyn Fn() -> f64,
    comparison: Option<Comparison>,
    line: Option<StraightLine>,
}

/// The noise of the residuals of plain least squares. `None` where the parameters cannot be told apart.
fn plain_noise(p: &Projection, min: &Minimum, free_t: bool) -> Option<NoiseFit> {
    let pivot = pivot(p, min, free_t);
    let s = p.sums(pivot, true);
    let l = p.linear(&s);
    let groups = p.groups(pivot, noise::GROUPS);
    let columns = noise::columns(p, &s, &groups, l.c1, free_t.then_some(pivot));
    let residual_sums: Vec<f64> = groups.iter().map(|b| b.y - l.c1 * b.g - l.c2 * b.n).collect();
    noise::fit(&groups, &columns, &residual_sums, p.moments.span_s)
}

/// All that is said of the minimum of a surface, given the noise.
fn complete(
    context: &Context,
    surface: &impl Surface,
    min: &Minimum,
    noise: &NoiseFit,
    reach: &Reach,
    weighting: Weighting,
) -> Fit {
    let &Context { p, free_t, .. } = context;
    let moments = p.moments;
    let [free_c1, free_c2] = p.free();
    let free = [free_c1, free_c2, free_t];
    let freedom = moments.count as f64 - free.iter().filter(|f| **f).count() as f64;
    let pivot = pivot(p, min, free_t);

    let places = placed(&free);
    let l = surface.linear_at(pivot);
    let spread = to_power_on(p, l.c1, pivot);
    let full = |m: &DMatrix<f64>| -> Matrix3<f64> {
        let at = |i: usize, j: usize| match (places[i], places[j]) {
            (Some(a), Some(b)) => m[(a, b)],
            _ => 0.0,
        };
        let local = Matrix3::from_fn(at);
        spread * local * spread.transpose()
    };
    let unit = full(&noise.inverse_normal);
    let covariances: Vec<Matrix3<f64>> = noise.members.iter().map(|m| full(&m.covariance)).collect();
    let covariance: Matrix3<f64> = noise.members.iter().zip(&covariances).map(|(m, c)| *c * m.weight).sum();
    let squares = match weighting {
        Weighting::Uniform => min.linear.rss.max(0.0),
        Weighting::Walk => p.squares(min),
    };
    let white_variance = squares / freedom;
    let if_white = match weighting {
        Weighting::Uniform => unit,
        Weighting::Walk => {
            let s = p.sums(pivot, true);
            let columns = noise::columns(p, &s, &[], l.c1, free_t.then_some(pivot));
            noise::inverse(&columns.normal).map_or_else(|| unit.map(|_| f64::NAN), |m| full(&m))
        }
    };

    let model = power_on(p, min);
    let values_at = [model.c1_rad_s, model.c2_rad_s, model.time_constant_s];
    let mut estimates = [Estimate { estimate: 0.0, std: 0.0, std_white: 0.0, ci95: [0.0; 2] }; 3];
    for j in 0..3 {
        let x = values_at[j];
        if !free[j] {
            estimates[j] = Estimate { estimate: x, std: 0.0, std_white: 0.0, ci95: [x; 2] };
            continue;
        }
        let variances: Vec<f64> = covariances.iter().map(|c| c[(j, j)]).collect();
        let half = noise.half_width(&variances, LEVEL);
        let kappa = half * half / unit[(j, j)];
        let ci95 = match j {
            _ if !free_t => [x - half, x + half],
            0 => profile::linear(surface, min, reach, profile::Target::C1, kappa),
            1 => profile::linear(surface, min, reach, profile::Target::C2, kappa),
            _ => profile::time_constant(surface, min, reach, kappa),
        };
        let std_white = (if_white[(j, j)] * white_variance).sqrt();
        estimates[j] = Estimate { estimate: x, std: covariance[(j, j)].sqrt(), std_white, ci95 };
    }
    let [c1_rad_s, c2_rad_s, time_constant_s] = estimates;
    let bounded = time_constant_s.ci95[0] > 0.0 && time_constant_s.ci95[1].is_finite();
    let identifiable = !free_t || (min.termination.converged() && bounded);
    let mut out = Fit {
        c1_rad_s,
        c2_rad_s,
        time_constant_s,
        covariance: to_array(&covariance),
        correlation: correlation(&covariance),
        identifiable,
        termination: min.termination,
        loss: Loss::Squares,
        weighting,
        residual_sum_of_squares_rad2_s2: squares,
        residual_std_rad_s: white_variance.sqrt(),
        degrees_of_freedom: freedom,
        samples: moments.count,
        sample_rate_hz: 1.0 / moments.step_s,
        first_s: moments.first_s,
        span_s: moments.span_s,
        noise: estimate_noise(noise, moments.step_s, white_variance, context.by_differences),
        comparison: context.comparison,
        line: context.line,
        other_weighting: None,
        colour: Vec::new(),
        advice: Vec::new(),
    };
    out.advice = advise(surface, noise, &out, free_t);
    out
}

/// Position of each of C1, C2, T among the free ones.
fn placed(free: &[bool; 3]) -> [Option<usize>; 3] {
    let mut next = 0;
    free.map(|f| {
        f.then(|| {
            next += 1;
            next - 1
        })
    })
}

fn to_array(m: &Matrix3<f64>) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| m[(i, j)]))
}

fn correlation(m: &Matrix3<f64>) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let scale = (m[(i, i)] * m[(j, j)]).sqrt();
            match scale > 0.0 {
                true => m[(i, j)] / scale,
                false => f64::from(u8::from(i == j)),
            }
        })
    })
}

fn estimate_noise(
    noise: &NoiseFit,
    step_s: f64,
    residual_variance: f64,
    by_differences: &dyn Fn() -> f64,
) -> NoiseEstimate {
    let probability = noise.walk_probability();
    // with a random walk in the residuals their variance is not the white noise's; successive differences still see it
    let white = if probability > 0.5 { by_differences() } else { residual_variance };
    let mut upper = 0.0;
    let mut below = 0.0;
    for member in &noise.members {
        below += member.weight;
        upper = member.walk_variance_rate.sqrt();
        if below >= 0.95 {
            break;
        }
    }
    NoiseEstimate {
        angle_random_walk_rad_sqrt_s: (white.max(0.0) * step_s).sqrt(),
        rate_random_walk_probability: probability,
        rate_random_walk_rad_s_sqrt_s: noise.mean(|m| m.walk_variance_rate).sqrt(),
        rate_random_walk_upper95_rad_s_sqrt_s: upper,
    }
}

/// Straight line through the log: the model at T so long that exp is linear. `None` where it cannot be fitted.
fn straight_line(moments: &Moments, options: &FitOptions) -> Option<StraightLine> {
    let given = options.fixed;
    if given.c1_rad_s.is_some() || given.c2_rad_s.is_some() || given.time_constant_s.is_some() {
        return None;
    }
    let p = Projection::new(moments, &Fixed::default());
    // at T of a million logs g = t/T to six digits of its curvature, and all its own digits are there
    let far = 1e6 * moments.span_s;
    let s = p.sums(far, false);
    let l = p.linear(&s);
    let groups = p.groups(far, noise::GROUPS);
    let columns = noise::columns(&p, &s, &groups, l.c1, None);
    let residuals: Vec<f64> = groups.iter().map(|b| b.y - l.c1 * b.g - l.c2 * b.n).collect();
    let noise = noise::fit(&groups, &columns, &residuals, moments.span_s)?;
    let white = l.rss.max(0.0) / (moments.count as f64 - 2.0);
    let of = |i: usize, value: f64, scale: f64| {
        let variances: Vec<f64> = noise.members.iter().map(|m| m.covariance[(i, i)] * scale * scale).collect();
        let half = noise.half_width(&variances, LEVEL);
        let std = noise.members.iter().zip(&variances).map(|(m, v)| m.weight * v).sum::<f64>().sqrt();
        let std_white = (white * noise.inverse_normal[(i, i)]).sqrt() * scale;
        Estimate { estimate: value, std, std_white, ci95: [value - half, value + half] }
    };
    Some(StraightLine { start_rad_s: of(1, l.c2 + moments.reference, 1.0), slope_rad_s2: of(0, l.c1 / far, 1.0 / far) })
}

/// How long to record. Where T is not known, for the shortest T that the log allows and for longer ones.
fn advise(p: &impl Surface, noise: &NoiseFit, fit: &Fit, free_t: bool) -> Vec<Advice> {
    if !free_t || !fit.warm_up_found() {
        return Vec::new();
    }
    // a walk that this log does not support is not held against a longer one
    let walk = fit.noise.rate_random_walk_probability > 0.5;
    let plan = |time_constant_s: f64| {
        let c1 = p.linear_at(time_constant_s).c1 * (p.clock_s() / time_constant_s).exp();
        advice::Plan {
            c1_rad_s: c1,
            time_constant_s,
            start_s: fit.first_s,
            rate_hz: fit.sample_rate_hz,
            white_variance: noise.mean(|m| m.white_variance),
            walk_variance_rate: if walk { noise.mean(|m| m.walk_variance_rate) } else { 0.0 },
        }
    };
    let recorded = fit.first_s + fit.span_s;
    if fit.identifiable {
        return vec![advice::advise(&plan(fit.time_constant_s.estimate), recorded)];
    }
    let [low, high] = fit.time_constant_s.ci95;
    let mut assumed = vec![low, fit.span_s, 3.0 * fit.span_s];
    assumed.retain(|t| *t > 0.0 && t.is_finite() && *t >= low && *t <= high);
    assumed.sort_by(f64::total_cmp);
    assumed.dedup();
    assumed.into_iter().map(|t| advice::advise(&plan(t), recorded)).collect()
}

#[cfg(test)]
mod tests;
