//! as recorded, or wheel_k → wheel_k / (1 - λ) inside bursts
//!
//! The drive with the lost ticks of one wheel restored, as another way of reading it. The bursts are found beside a model
//! (see [`super::lost_ticks`]); the model is then settled on the restored drive.

use super::changepoint;
use super::hypothesis::PreprocessingHypothesis;
use super::lost_ticks::{self, LostTicks, Predicted, Sought};
use crate::effects::drive::Driving;
use crate::gap::drive::ekf::innovations::run;
use crate::gap::drive::ekf::noise::Noise;
use crate::gap::drive::fit::{Compared, Theta, models_at};
use crate::gap::drive::options::{HOPELESS, LARGE, Options, WORTH};
use crate::gap::drive::record::Record;
use crate::gap::drive::regressors::candidates::Candidates;
use rayon::prelude::*;

/// Most accounts of lost ticks that are compared.
const TRIED: usize = 4;
/// Nats by which an account may fall short before free forms have been tried beside it.
const SHORT: f64 = 50.0;
/// Share of what the innovations lack that makes up most of it.
const MOST: f64 = 0.5;

/// Accounts of lost ticks beside the model at each θ of `from`, each with its ln p of the drive under that model, the
/// most probable first.
fn accounts_at(
    record: &Record,
    candidates: &Candidates,
    noise: &Noise,
    from: &[&Theta],
) -> Vec<(f64, LostTicks, Theta)> {
    let found = |(theta, side): (&'_ Theta, usize)| -> Vec<(f64, LostTicks, Theta)> {
        let models = models_at(record, candidates, theta);
        let predicted = Predicted::of(record, &models, noise, side);
        // slow errors of the model look like bursts, and long bursts like slow errors: both are tried
        let mut worth =
            [true, false].map(|slow| predicted.accounts(record, Sought { side, loss: None, slow })).concat();
        worth.retain(|b| b.ln_evidence > WORTH);
        let weighed = |b: LostTicks| (lost_ticks::weight(record, &models, noise, &b), b, theta.clone());
        worth.into_par_iter().map(weighed).collect()
    };
    let tried: Vec<(&Theta, usize)> = from.iter().flat_map(|theta| [0, 1].map(|side| (*theta, side))).collect();
    let mut all: Vec<(f64, LostTicks, Theta)> = tried.into_par_iter().flat_map_iter(found).collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    // the same account from another model leads to the same comparison
    let mut seen: Vec<Vec<f64>> = Vec::new();
    all.retain(|(_, b, _)| {
        !seen.contains(&b.lost) && {
            seen.push(b.lost.clone());
            true
        }
    });
    all
}

/// ln weight of these bursts beside the restored drive, nats: what they cost, and the prior odds of lost ticks.
fn own_nats(bursts: &LostTicks, options: &Options) -> f64 {
    bursts.ln_path + bursts.ln_jacobian() + options.prior.ln_named
}

/// The restored drive with the comparison `compared` of sets on it; `own_nats`: see [`own_nats`].
fn hypothesis(restored: Record, noise: Noise, compared: Compared, own_nats: f64) -> PreprocessingHypothesis {
    let onsets_s = changepoint::of_each(&restored);
    let mut hypothesis = PreprocessingHypothesis::new(restored, noise, compared, onsets_s);
    hypothesis.restored = true;
    hypothesis.extra_weight += own_nats;
    hypothesis
}

/// The drive with the lost ticks of one wheel restored, where bursts make up most of what the innovations of the nominal
/// model lack, and named effects explain all that is left; else none. `all`: candidates of the drive as recorded, of
/// which nothing has been fitted yet; `begin`: θ to start from.
pub(crate) fn restored_at_once(
    record: &Record,
    all: &Candidates,
    begin: &Theta,
    noise: &Noise,
    effects: &[&'static dyn Driving],
    options: &Options,
) -> Option<(PreprocessingHypothesis, LostTicks)> {
    let zero = all.zero();
    let models = models_at(record, all, &zero);
    // innovations of the true model lack nothing: z² has the mean one
    let mut lack = 0.0;
    let as_recorded = run(record, &models, noise, &[], |i| lack += 0.5 * (i.white * i.white - 1.0)).ln_likelihood();
    if lack < LARGE {
        return None;
    }
    let mut from = vec![&zero, begin];
    from.dedup();
    let (ln_p, bursts, theta) = accounts_at(record, all, noise, &from).into_iter().next()?;
    if ln_p - as_recorded < MOST * lack {
        return None;
    }
    let restored = bursts.restored(record);
    let named = all.only(|g| all.groups[g].named).without_lost_ticks();
    let compared = Compared::narrow(&restored, noise, named, theta, None);
    let mut other = hypothesis(restored, *noise, compared, own_nats(&bursts, options));
    other.bent_nats = ln_p - as_recorded;
    other.widen(effects, options, other.compared.steps_s());
    if !other.is_named() {
        return None;
    }
    other.settle(effects, options);
    other.is_settled().then_some((other, bursts))
}

/// The drive with the lost ticks of one wheel restored, in the account that explains it best; none where no account
/// comes near `best_top`, the ln weight of the best way that is known: `as_is` or another.
pub(crate) fn restored(
    record: &Record,
    (as_is, best_top): (&PreprocessingHypothesis, f64),
    begin: &Theta,
    noise: &Noise,
    effects: &[&'static dyn Driving],
    options: &Options,
) -> Option<(PreprocessingHypothesis, LostTicks)> {
    // restored ticks are not also missing on average
    let all = &as_is.compared.candidates;
    let (zero, begin, here) =
        (all.zero(), all.without_lost_ticks_in(begin), all.without_lost_ticks_in(&as_is.compared.theta));
    // beside a settled set without free forms no other start is needed
    let mut from = if as_is.is_quiet() { vec![&here] } else { vec![&zero, &begin, &here] };
    from.dedup();
    let mut accounts = accounts_at(record, all, &as_is.noise, &from);
    accounts.truncate(TRIED);
    let fresh = Noise { process: as_is.noise.process, ..*noise };
    let plausible = as_is.compared.plausible().without_lost_ticks();
    let as_is_top = as_is.top();
    // where the noise of the drive as recorded is as stated, restored ticks do not gain by other noise
    let as_stated = as_is.is_quiet() && as_is.levels.is_empty() && as_is.put_aside == [0; 3];
    let short = if as_stated { SHORT } else { HOPELESS };
    let settle = |bursts: LostTicks, theta: &Theta| {
        let restored = bursts.restored(record);
        let own = own_nats(&bursts, options);
        let hopeless = best_top - own - short;
        let compared = Compared::narrow(&restored, &fresh, plausible.clone(), theta.clone(), Some(hopeless));
        let mut other = hypothesis(restored, fresh, compared, own);
        other.bent_nats = (other.top() - as_is_top).max(0.0);
        other.promising.clone_from(&as_is.promising);
        if other.top() > best_top - short {
            other.clean(effects, options);
        }
        (other, bursts)
    };
    let better = |a: &(PreprocessingHypothesis, LostTicks), b: &(PreprocessingHypothesis, LostTicks)| {
        a.0.top().total_cmp(&b.0.top())
    };
    let accounts: Vec<(PreprocessingHypothesis, LostTicks)> =
        accounts.into_par_iter().map(|(_, bursts, theta)| settle(bursts, &theta)).collect();
    let best = accounts.into_iter().max_by(better)?;
    // once more with the model found so far, without taking out slow errors
    let theta = best.0.compared.next().0;
    let models = models_at(record, &best.0.compared.candidates, &theta);
    let sought = Sought { side: best.1.side, loss: None, slow: false };
    let again: Vec<(f64, LostTicks)> = lost_ticks::accounts(record, &models, &best.0.noise, sought)
        .into_par_iter()
        .map(|b| (lost_ticks::weight(record, &models, &best.0.noise, &b), b))
        .collect();
    let again = again.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, bursts)| settle(bursts, &theta));
    let best = again.into_iter().chain([best]).max_by(better);
    // compared with plausible sets alone, it may fall short by the gain of free forms
    let (mut other, bursts) = best.filter(|b| b.0.top() > best_top - SHORT)?;
    other.widen(effects, options, other.compared.steps_s());
    other.settle(effects, options);
    (other.top() > best_top - SHORT).then_some((other, bursts))
}
