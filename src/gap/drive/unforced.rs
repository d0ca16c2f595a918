//! q̂ = argmax ln p(z | q, φ):   a_{k+1} = φ a_k,  v and ω diffuse with q
//!
//! How a robot moves whose torques were not logged. At the maximum the likelihood does not care, to first order, whether all
//! speeds are a little larger: away from it a common scale of radius and track would have evidence of its own, which it must
//! not have.

use super::pass::{Models, Noise, Unforced, run};
use super::record::Record;

/// Where the search begins.
const BEGIN: Unforced = Unforced { diffusion: [0.001, 0.002], lasting: 0.9 };
/// Shares of an acceleration that may last from row to row.
const LASTING: [f64; 6] = [0.0, 0.5, 0.75, 0.9, 0.95, 1.0];
/// Steps of the search in ln q: the first, and where parabolas take over.
const STEPS: [f64; 2] = [2.1, 0.3];
/// Rounds of parabolas; each takes the error of the one before to the third power.
const ROUNDS: usize = 2;
/// Diffusions within these are sensible, m²/s³ and rad²/s³.
const SENSIBLE: std::ops::Range<f64> = 1e-9..1e4;

/// The most likely, under `models`.
#[must_use]
pub(super) fn likely(record: &Record, models: &Models, noise: &Noise) -> Unforced {
    let weigh = |unforced: Unforced| run(record, models, &Noise { unforced, ..*noise }, &[], |_| {}).ln_likelihood();
    let times = |from: Unforced, i: usize, factor: f64| {
        let mut next = from;
        next.diffusion[i] *= factor;
        next
    };
    let sensible = |u: &Unforced| u.diffusion.iter().all(|q| SENSIBLE.contains(q));
    let mut here = BEGIN;
    let mut best = weigh(here);
    let mut step = STEPS[0];
    while step > STEPS[1] {
        let mut moved = false;
        for (i, sign) in [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)] {
            let next = times(here, i, f64::exp(sign * step));
            let weight = weigh(next);
            if weight > best && sensible(&next) {
                (best, here, moved) = (weight, next, true);
            }
        }
        if !moved {
            step *= 0.5;
        }
    }
    for lasting in LASTING {
        let next = Unforced { lasting, ..here };
        let weight = weigh(next);
        if weight > best {
            (best, here) = (weight, next);
        }
    }
    for _ in 0..ROUNDS {
        for i in 0..2 {
            let [below, above] = [-step, step].map(|s| weigh(times(here, i, s.exp())));
            let bend = 2.0 * best - below - above;
            if bend > 0.0 {
                let by = (0.5 * step * (above - below) / bend).clamp(-step, step);
                let next = times(here, i, by.exp());
                let weight = weigh(next);
                if weight > best && sensible(&next) {
                    (best, here) = (weight, next);
                }
            }
        }
        step *= 0.5;
    }
    here
}
