//! y ∈ { offset + k · lsb }: values on a lattice; ln p(y) = ln [Φ((y + lsb/2 - m)/σ) - Φ((y - lsb/2 - m)/σ)] - ln lsb

use crate::math::lattice;
use crate::units::RAD_S_PER_DEG_S;
use statrs::function::erf::erfc;
use std::f64::consts::{SQRT_2, TAU};

/// A printed value is this close to its level at most, in steps.
const NEAR: f64 = 0.1;
/// Probability of values on no lattice to be taken for some on one.
const CHANCE: f64 = 1e-3;

/// Step of the lattice on which the values lie; none where they lie on none.
///
/// The step is the largest of which all differences are multiples: the smallest difference is a multiple of it, so it
/// is that or a small fraction of it.
#[must_use]
pub(crate) fn step(values: &[f64]) -> Option<f64> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let largest = sorted.first()?.abs().max(sorted.last()?.abs());
    // differences below the rounding of the numbers themselves are none, and a file in single precision is no lattice
    let single = sorted.iter().all(|v| f64::from(*v as f32) == *v);
    let rounding = if single { f64::from(f32::EPSILON) } else { 4.0 * f64::EPSILON } * largest;
    let differences: Vec<f64> = sorted.windows(2).map(|w| w[1] - w[0]).filter(|d| *d > rounding).collect();
    if differences.len() < 2 || sorted.len() < 100 {
        return None;
    }
    let least = differences.iter().copied().fold(f64::INFINITY, f64::min);
    let on_lattice = |lsb: f64| {
        let tolerance = (4.0 * rounding / lsb).max(1e-6);
        tolerance < 0.02
            && differences.iter().all(|d| {
                let k = d / lsb;
                (k - k.round()).abs() <= tolerance + 1e-9 * k
            })
    };
    // neighbouring levels: what lies between them is rounding
    let least =
        differences.iter().copied().filter(|d| *d > 1.5 * least.min(rounding * 2.0)).fold(f64::INFINITY, f64::min);
    let exact = (1..=4).map(|q| least / f64::from(q)).find(|lsb| on_lattice(*lsb));
    let Some(lsb) = exact else { return rounded(&sorted, rounding) };
    // sharpened by the whole range
    let span = sorted.last()? - sorted.first()?;
    let count = (span / lsb).round();
    Some(if count >= 1.0 { span / count } else { lsb })
}

/// The step where a text file has rounded the values: few different ones, nearly all closer to the levels of one
/// lattice than chance would have them.
fn rounded(sorted: &[f64], rounding: f64) -> Option<f64> {
    let levels: Vec<f64> = sorted.chunk_by(|a, b| b - a <= rounding).map(|same| same[same.len() / 2]).collect();
    if 4 * levels.len() > sorted.len() {
        return None;
    }
    let found = lattice::through(&levels)?;
    // values on no lattice lie within ε of one with probability 2ε each, but for the two by which it was drawn
    let near = (0.5 * CHANCE.powf(1.0 / (levels.len() as f64 - 2.0))).min(NEAR);
    let on = levels.iter().filter(|x| lattice::off(found, **x) <= near).count();
    (on * 200 >= levels.len() * 199).then_some(found.1)
}

/// Units in which a file may state a rate, in rad/s: rad/s, °/s, °/h.
const UNITS_RAD_S: [f64; 3] = [1.0, RAD_S_PER_DEG_S, RAD_S_PER_DEG_S / 3600.0];
/// A printed number this close to a decimal is that decimal, in units of its last digit.
const PRINTED: f64 = 0.02;
/// Most digits after the point.
const MOST_DECIMALS: i32 = 15;

/// Numbers written in decimals: with so many digits after the point, or so many digits in all.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Print {
    unit_rad_s: f64,
    /// Digits after the point of the numbers that begin at a power of ten, the largest numbers first.
    decimals: Vec<(i32, i32)>,
}

impl Print {
    /// How `values_rad_s` were written; none where they are no short decimals in any unit.
    #[must_use]
    pub(crate) fn of(values_rad_s: &[f64]) -> Option<Self> {
        UNITS_RAD_S.iter().find_map(|unit| Self::in_unit(values_rad_s, *unit))
    }

    fn in_unit(values_rad_s: &[f64], unit_rad_s: f64) -> Option<Self> {
        let there = || values_rad_s.iter().copied().filter(|v| v.is_finite());
        let largest = there().fold(0.0, |m: f64, v| m.max(v.abs())) / unit_rad_s;
        let single = there().all(|v| f64::from(v as f32) == v);
        let rounding = largest * if single { f64::from(f32::EPSILON) } else { 4.0 * f64::EPSILON };
        // beyond these decimals every number is one
        let powers: Vec<f64> =
            (0..=MOST_DECIMALS).map(|k| 10_f64.powi(k)).take_while(|p| rounding * p < PRINTED).collect();
        let mut decimals: std::collections::BTreeMap<i32, i32> = std::collections::BTreeMap::new();
        for v in there().map(|v| v / unit_rad_s).filter(|v| *v != 0.0) {
            let fits = |k: usize| {
                let scaled = v * powers[k];
                (scaled - scaled.round()).abs() <= rounding * powers[k] + 1e-9
            };
            let most = decimals.entry(-(v.abs().log10().floor() as i32)).or_insert(0);
            *most = (*most as usize..powers.len()).find(|k| fits(*k))? as i32;
        }
        let mut so_far = 0;
        for most in decimals.values_mut() {
            // smaller numbers have no fewer decimals
            so_far = so_far.max(*most);
            *most = so_far;
        }
        let decimals: Vec<(i32, i32)> = decimals.into_iter().map(|(power, k)| (-power, k)).collect();
        (!decimals.is_empty()).then_some(Self { unit_rad_s, decimals })
    }

    /// Distance of neighbouring numbers at `value_rad_s`, rad/s.
    #[must_use]
    pub(crate) fn step_rad_s(&self, value_rad_s: f64) -> f64 {
        let power = (value_rad_s.abs() / self.unit_rad_s).log10().floor();
        let found = self.decimals.iter().find(|(p, _)| f64::from(*p) <= power).or(self.decimals.last());
        self.unit_rad_s * 10_f64.powi(-found.map_or(0, |d| d.1))
    }

    /// The largest distance of neighbouring numbers, rad/s.
    #[must_use]
    pub(crate) fn coarsest_rad_s(&self) -> f64 {
        self.unit_rad_s * 10_f64.powi(-self.decimals.first().map_or(0, |d| d.1))
    }
}

/// A decimal lattice of at most this part of the white noise is how the file was printed.
const FINE_PRINT: f64 = 0.1;
/// A lattice finer than this part of the white noise changes nothing.
const FINEST: f64 = 0.01;

/// The lattice of a recording: the sensor's own, and how the file keeps its numbers.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Grain {
    /// Step of the sensor's lattice, rad/s; none where the values lie on none that matters, or on that of the print.
    pub lsb_rad_s: Option<f64>,
    lattice_rad_s: Option<f64>,
    print: Option<Print>,
    resolution: f64,
}

impl Grain {
    /// That of `recorded`, whose white noise has the standard deviation `white_std_rad_s`.
    #[must_use]
    pub(crate) fn of(recorded: &[f64], white_std_rad_s: f64) -> Self {
        let lattice = step(recorded);
        let print = Print::of(recorded);
        let printed = print.as_ref().map_or(0.0, Print::coarsest_rad_s);
        let is_print = |lsb: f64| lsb < 1.5 * printed && printed <= FINE_PRINT * white_std_rad_s * (1.0 + 1e-9);
        let there = || recorded.iter().copied().filter(|v| v.is_finite());
        let single = there().all(|v| f64::from(v as f32) == v);
        Self {
            lsb_rad_s: lattice.filter(|lsb| *lsb > FINEST * white_std_rad_s && !is_print(*lsb)),
            lattice_rad_s: lattice,
            print,
            resolution: there().fold(0.0, |m: f64, v| m.max(v.abs()))
                * if single { f64::from(f32::EPSILON) } else { f64::EPSILON },
        }
    }

    /// Distance of neighbouring numbers at `value_rad_s`, rad/s.
    #[must_use]
    pub(crate) fn step_rad_s(&self, value_rad_s: f64) -> f64 {
        let printed = self.print.as_ref().map_or(0.0, |p| p.step_rad_s(value_rad_s));
        // where the number of decimals varies with the size of the numbers, the lattice is only that of the finest ones
        let lattice = if printed > 0.0 && self.lsb_rad_s.is_none() { None } else { self.lattice_rad_s };
        printed.max(lattice.unwrap_or(0.0)).max(self.resolution)
    }

    /// Variance of the rounding to the lattice or the print, rad²/s².
    #[must_use]
    pub(crate) fn variance(&self) -> f64 {
        let printed = self.print.as_ref().map_or(0.0, Print::coarsest_rad_s);
        let step = self.lsb_rad_s.unwrap_or(printed);
        step * step / 12.0
    }
}

/// ln of the normal probability of [a, b].
fn ln_cell(a: f64, b: f64) -> f64 {
    // by the tail that does not cancel
    let (a, b) = if a + b > 0.0 { (a, b) } else { (-b, -a) };
    let p = 0.5 * (erfc(a / SQRT_2) - erfc(b / SQRT_2));
    if p > 0.0 { p.ln() } else { -0.5 * a * a - (a.max(1.0) * TAU.sqrt()).ln() }
}

/// Gain in log-likelihood of the lattice over a density of standard deviation `nominal`, given the deviations of the
/// values from what is predicted, in rad/s.
#[must_use]
pub(crate) fn gain(deviations: &[f64], lsb: f64, std: f64, nominal: f64) -> f64 {
    let one = |d: &f64| {
        let cell = ln_cell((d - 0.5 * lsb) / std, (d + 0.5 * lsb) / std) - lsb.ln();
        let density = -0.5 * ((d / nominal).powi(2) + (TAU * nominal * nominal).ln());
        cell - density
    };
    deviations.iter().map(one).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    #[test]
    fn a_lattice_is_found_with_any_offset_and_noise_has_none() {
        let mut draw = Stream::new(1, 0);
        let noise: Vec<f64> = (0..2000).map(|_| 1e-3 * draw.normal()).collect();
        assert_eq!(step(&noise), None);
        for lsb in [1e-3, 1e-4, 3.3e-6] {
            let on: Vec<f64> = noise.iter().map(|v| 0.37 * lsb + (v / lsb).round() * lsb).collect();
            let found = step(&on).unwrap();
            assert!((found / lsb - 1.0).abs() < 1e-6, "{lsb}: {found}");
        }
        // as a text file with seven digits has it
        let lsb = 1.330_281e-4;
        let text = |v: f64| format!("{:.6e}", (v / lsb).round() * lsb).parse::<f64>().unwrap();
        let written: Vec<f64> = noise.iter().map(|v| text(v + 0.02)).collect();
        assert!((step(&written).unwrap() / lsb - 1.0).abs() < 1e-3);
        // printed with a last digit of a fortieth and of a sixth of the step: 3.95 °/s with one decimal, 0.63 °/s
        // likewise
        for lsb in [3.95, 0.63] {
            let text = |v: f64| format!("{:.1}", (v / lsb).round() * lsb).parse::<f64>().unwrap() * RAD_S_PER_DEG_S;
            let written: Vec<f64> = noise.iter().map(|v| text(1e4 * v)).collect();
            // the levels at both ends are known to half a digit each
            let ends = written.iter().fold([0.0_f64; 2], |[low, high], v| [low.min(*v), high.max(*v)]);
            let digits = (ends[1] - ends[0]) / (0.1 * RAD_S_PER_DEG_S);
            assert!((step(&written).unwrap() / (lsb * RAD_S_PER_DEG_S) - 1.0).abs() * digits < 1.0, "{lsb}");
        }
        // ticks timed over a whole period each: few different values, on no lattice
        let timed: Vec<f64> = noise.iter().map(|v| 1.0 / (40.0 + (1e4 * v).round())).collect();
        assert_eq!(step(&timed), None);
    }

    #[test]
    fn print_is_told_from_a_lattice_in_every_unit() {
        let mut draw = Stream::new(2, 0);
        let white = 1e-3;
        let noise: Vec<f64> = (0..5000).map(|_| 0.03 + white * draw.normal()).collect();
        assert_eq!(Print::of(&noise), None);
        assert_eq!(Grain::of(&noise, white).lsb_rad_s, None);
        for unit in UNITS_RAD_S {
            for decimals in 2..9 {
                let text = |v: &f64| format!("{:.decimals$}", v / unit).parse::<f64>().unwrap() * unit;
                let written: Vec<f64> = noise.iter().map(text).collect();
                let step = unit * 10_f64.powi(-(decimals as i32));
                let grain = Grain::of(&written, white);
                if step > white {
                    continue;
                }
                let found = grain.step_rad_s(0.03);
                assert!((found / step - 1.0).abs() < 1e-3, "{decimals} decimals of {unit}: {found} for {step}");
                // coarser than a tenth of the noise it is the sensor's
                assert_eq!(grain.lsb_rad_s.is_some(), step > 0.1 * white, "{decimals} decimals of {unit}: {grain:?}");
            }
            // eight digits in all: numbers below the power of ten have one more decimal
            let text = |v: &f64| format!("{:.7e}", v / unit).parse::<f64>().unwrap() * unit;
            let written: Vec<f64> = noise.iter().map(|v| text(&(v - 0.02))).collect();
            let grain = Grain::of(&written, white);
            assert_eq!(grain.lsb_rad_s, None);
            let power = |v: f64| unit * 10_f64.powf((v / unit).log10().floor() - 7.0);
            for v in [0.0094, 0.0108] {
                assert!((grain.step_rad_s(v) / power(v) - 1.0).abs() < 1e-6, "{unit} {v}: {grain:?}");
            }
        }
        // a converter's step that was printed with many decimals stays the converter's
        let lsb = 0.01 * RAD_S_PER_DEG_S / 1.31;
        let text = |v: &f64| format!("{:.6}", (v / lsb).round() * lsb / RAD_S_PER_DEG_S).parse::<f64>().unwrap();
        let written: Vec<f64> = noise.iter().map(|v| text(v) * RAD_S_PER_DEG_S).collect();
        assert!((Grain::of(&written, white).lsb_rad_s.unwrap() / lsb - 1.0).abs() < 1e-3);
    }
}
