//! e(t) = C1 g(t; T) + C2 with g = 1 - exp(-t/T): for given T the rest is linear (variable projection;
//! Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413). All inner products come from block moments.

use super::minimum::Minimum;
use super::options::Fixed;
use super::surface::{Linear, Surface};
use crate::math::legendre::{self, COUNT};
use crate::signal::Moments;
use rayon::prelude::*;

/// Beyond this many time constants exp(-t/T) is below the rounding of 1.
const GONE: f64 = 45.0;

/// The shortest of growing groups are this part of the log, or that many samples: what is correlated from one sample
/// to the next is white among them.
pub(super) const SHORTEST: f64 = 32_768.0;
const FEWEST: f64 = 64.0;
/// Classes that one core takes at once, at least: fewer cost less than to hand them over.
const TOGETHER: usize = 256;

/// Sums over the samples, with g = 1 - exp(-u), d = u exp(-u) = -∂g/∂ln T, u = t/T.
/// y counts from the moments' reference.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums {
    pub n: f64,
    pub g: f64,
    pub gg: f64,
    pub y: f64,
    pub gy: f64,
    pub d: f64,
    pub gd: f64,
    pub dd: f64,
    pub dy: f64,
}

/// Sums of one block, for the noise model: count, middle, begin and end (s from the first sample), Σy, Σg, Σd.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct BlockSum {
    pub n: f64,
    pub mid_s: f64,
    /// Half a step before the first sample.
    pub begin_s: f64,
    /// Half a step after the last.
    pub end_s: f64,
    pub y: f64,
    pub g: f64,
    pub d: f64,
}

/// Sums over a class of blocks at one T, without the blocks' positions.
#[derive(Clone, Copy)]
struct ClassAt {
    n: f64,
    /// q0 - 1
    first_less_one: f64,
    /// q, and q without its constant term
    q: [f64; COUNT],
    tail: [f64; COUNT],
    /// (half/T) x exp(-half x / T)
    x: [f64; COUNT],
    one_q: f64,
    one_tail: f64,
    one_x: f64,
    tail_tail: f64,
    qq: f64,
    qx: f64,
    xx: f64,
    tail_q: f64,
    tail_x: f64,
}

/// The least-squares problem with T as its only nonlinear parameter.
#[derive(Debug, Clone)]
pub(super) struct Projection<'a> {
    pub moments: &'a Moments,
    /// Time of the log's first sample in the clock of g, s.
    pub offset_s: f64,
    /// Known C1 and C2 (absolute, in the clock of g).
    pub c1: Option<f64>,
    pub c2: Option<f64>,
}

/// 1 - exp(-alpha), `e` being exp(-alpha); the slower function only where more than three digits would cancel.
#[inline]
fn one_less(alpha: f64, e: f64) -> f64 {
    if alpha > 1e-3 { 1.0 - e } else { -(-alpha).exp_m1() }
}

impl<'a> Projection<'a> {
    /// With C1 and C2 both free, g may count from the first sample: exp(-t0/T) only scales it, and so it keeps
    /// its digits however late the log begins. A known C1 or C2 is one at power-on, and g must count from there.
    pub(crate) fn new(moments: &'a Moments, fixed: &Fixed) -> Self {
        let local = fixed.c1_rad_s.is_none() && fixed.c2_rad_s.is_none();
        Self { moments, offset_s: if local { 0.0 } else { moments.first_s }, c1: fixed.c1_rad_s, c2: fixed.c2_rad_s }
    }

    fn classes_at(&self, time_constant: f64, derivative: bool) -> Vec<ClassAt> {
        let quadratic = |g: &[[f64; COUNT]; COUNT], a: &[f64; COUNT], b: &[f64; COUNT]| -> f64 {
            g.iter().zip(a).map(|(row, a)| a * legendre::dot(row, b)).sum()
        };
        self.moments
            .classes
            .par_iter()
            .with_min_len(TOGETHER)
            .map(|class| {
                let h = class.half_s / time_constant;
                // so wide a block lies where exp(-t/T) is gone, and is never asked for q
                let e = legendre::exponential(h.min(GONE));
                let (q, gram) = (e.plain, &class.gram);
                let mut tail = q;
                tail[0] = 0.0;
                let x = e.times_x.map(|v| h * v);
                // a block of one sample has no width: q is 1 and all else vanishes
                let wide = class.count > 1;
                let form = |wanted: bool, a: &[f64; COUNT], b: &[f64; COUNT]| {
                    if wanted && wide { quadratic(gram, a, b) } else { 0.0 }
                };
                ClassAt {
                    n: class.count as f64,
                    first_less_one: e.first_less_one,
                    one_q: legendre::dot(&gram[0], &q),
                    one_tail: legendre::dot(&gram[0], &tail),
                    one_x: legendre::dot(&gram[0], &x),
                    tail_tail: form(true, &tail, &tail),
                    qq: if wide { form(derivative, &q, &q) } else { 1.0 },
                    qx: form(derivative, &q, &x),
                    xx: form(derivative, &x, &x),
                    tail_q: form(derivative, &tail, &q),
                    tail_x: form(derivative, &tail, &x),
                    q,
                    tail,
                    x,
                }
            })
            .collect()
    }

    /// The sums at `time_constant`; those with d only where `derivative` asks for them.
    pub(crate) fn sums(&self, time_constant: f64, derivative: bool) -> Sums {
        let classes = self.classes_at(time_constant, derivative);
        let mut s = Sums::default();
        for block in &self.moments.blocks {
            let c = &classes[block.class];
            let m = &block.moments;
            s.n += c.n;
            s.y += m[0];
            let mid = block.mid_s + self.offset_s;
            let half = self.moments.classes[block.class].half_s;
            if (mid - half) / time_constant > GONE {
                s.g += c.n;
                s.gg += c.n;
                s.gy += m[0];
                continue;
            }
            let alpha = mid / time_constant;
            let e = (-alpha).exp();
            // g = a - e·tail, a = 1 - e·q0 without its cancellation
            let a = one_less(alpha, e) - e * c.first_less_one;
            s.g += a * c.n - e * c.one_tail;
            s.gg += a * a * c.n - 2.0 * a * e * c.one_tail + e * e * c.tail_tail;
            s.gy += a * m[0] - e * legendre::dot(&c.tail, m);
            if derivative {
                let d = e * (alpha * c.one_q + c.one_x);
                s.d += d;
                s.gd += a * d - e * e * (alpha * c.tail_q + c.tail_x);
                s.dd += e * e * (alpha * alpha * c.qq + 2.0 * alpha * c.qx + c.xx);
                s.dy += e * (alpha * legendre::dot(&c.q, m) + legendre::dot(&c.x, m));
            }
        }
        s
    }

    /// Block sums at `time_constant`, neighbours merged to at most about `most` groups.
    pub(crate) fn groups(&self, time_constant: f64, most: usize) -> Vec<BlockSum> {
        let per_group = self.moments.count as f64 / most as f64;
        self.merged(time_constant, |_| per_group)
    }

    /// Block sums at `time_constant` whose lengths grow with time up to those of [`Self::groups`]: a short warm-up in a
    /// long log lies in its first groups, and they show it.
    pub(crate) fn growing_groups(&self, time_constant: f64, most: usize) -> Vec<BlockSum> {
        let count = self.moments.count as f64;
        let longest = count / most as f64;
        let shortest = (count / SHORTEST).max(FEWEST).min(longest);
        self.merged(time_constant, |before| (before / 16.0).clamp(shortest, longest))
    }

    /// Block sums, neighbours merged up to the length that `length` gives for the number of samples before.
    fn merged(&self, time_constant: f64, length: impl Fn(f64) -> f64) -> Vec<BlockSum> {
        let classes = self.classes_at(time_constant, false);
        let half_step = 0.5 * self.moments.step_s;
        let mut groups: Vec<BlockSum> = Vec::new();
        let (mut open, mut before) = (BlockSum::default(), 0.0);
        for block in &self.moments.blocks {
            let c = &classes[block.class];
            let mid = block.mid_s + self.offset_s;
            let half = self.moments.classes[block.class].half_s;
            let (mut g, mut d) = (c.n, 0.0);
            if (mid - half) / time_constant <= GONE {
                let alpha = mid / time_constant;
                let e = (-alpha).exp();
                let a = one_less(alpha, e) - e * c.first_less_one;
                g = a * c.n - e * c.one_tail;
                d = e * (alpha * c.one_q + c.one_x);
            }
            if open.n == 0.0 {
                open.begin_s = block.mid_s - half - half_step;
            }
            open.end_s = block.mid_s + half + half_step;
            open.n += c.n;
            open.mid_s += c.n * block.mid_s;
            open.y += block.moments[0];
            open.g += g;
            open.d += d;
            if open.n >= length(before) {
                before += open.n;
                groups.push(open);
                open = BlockSum::default();
            }
        }
        if open.n > 0.0 {
            groups.push(open);
        }
        for group in &mut groups {
            group.mid_s /= group.n;
        }
        groups
    }

    /// Best C1 and C2 (those that are free) for the sums of one T.
    pub(crate) fn linear(&self, s: &Sums) -> Linear {
        let reference = self.moments.reference;
        let yy = self.moments.square_sum;
        match (self.c1, self.c2) {
            (None, None) => {
                let gg = s.gg - s.g * s.g / s.n;
                let gy = s.gy - s.g * s.y / s.n;
                let c1 = if gg > 0.0 { gy / gg } else { 0.0 };
                let c2 = (s.y - c1 * s.g) / s.n;
                Linear { c1, c2, rss: yy - s.y * s.y / s.n - c1 * gy }
            }
            (None, Some(c2)) => {
                let c2 = c2 - reference;
                let gy = s.gy - c2 * s.g;
                let c1 = if s.gg > 0.0 { gy / s.gg } else { 0.0 };
                Linear { c1, c2, rss: yy - 2.0 * c2 * s.y + c2 * c2 * s.n - c1 * gy }
            }
            (Some(c1), None) => {
                let c2 = (s.y - c1 * s.g) / s.n;
                let yy = yy - 2.0 * c1 * s.gy + c1 * c1 * s.gg;
                Linear { c1, c2, rss: yy - c2 * c2 * s.n }
            }
            (Some(c1), Some(c2)) => {
                let c2 = c2 - reference;
                let rss = yy + c1 * c1 * s.gg + c2 * c2 * s.n - 2.0 * (c1 * s.gy + c2 * s.y - c1 * c2 * s.g);
                Linear { c1, c2, rss }
            }
        }
    }

    /// Σ r² over the samples at a minimum of whatever surface.
    pub(crate) fn squares(&self, min: &Minimum) -> f64 {
        let (s, l) = (self.sums(min.time_constant, false), min.linear);
        let along = l.c1 * s.gy + l.c2 * s.y - l.c1 * l.c2 * s.g;
        (self.moments.square_sum + l.c1 * l.c1 * s.gg + l.c2 * l.c2 * s.n - 2.0 * along).max(0.0)
    }

    /// Half the derivative of the sum of squares by ln T: by the envelope theorem the linear parameters stand still.
    pub(crate) fn slope(&self, ln_t: f64) -> f64 {
        let s = self.sums(ln_t.exp(), true);
        let l = self.linear(&s);
        l.c1 * (s.dy - l.c1 * s.gd - l.c2 * s.d)
    }

    /// Which of C1, C2 are free.
    pub(crate) fn free(&self) -> [bool; 2] {
        [self.c1.is_none(), self.c2.is_none()]
    }
}

impl Surface for Projection<'_> {
    fn linear_at(&self, time_constant: f64) -> Linear {
        self.linear(&self.sums(time_constant, false))
    }

    fn inverse_normal(&self, time_constant: f64) -> [[f64; 2]; 2] {
        let s = self.sums(time_constant, false);
        match self.free() {
            [true, true] => {
                let (gg, mean) = (s.gg - s.g * s.g / s.n, s.g / s.n);
                [[1.0 / gg, -mean / gg], [-mean / gg, 1.0 / s.n + mean * mean / gg]]
            }
            [true, false] => [[1.0 / s.gg, 0.0], [0.0, 0.0]],
            [false, true] => [[0.0, 0.0], [0.0, 1.0 / s.n]],
            [false, false] => [[0.0; 2]; 2],
        }
    }

    fn clock_s(&self) -> f64 {
        self.moments.first_s - self.offset_s
    }

    fn reference(&self) -> f64 {
        self.moments.reference
    }
}
