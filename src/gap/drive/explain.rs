//! θ̂ = argmax ln p(z | θ) + ln p(θ): given effects, and no others, fitted together to a drive
//!
//! The gain of an effect is ln p with all of them over ln p without it, at θ̂ and with the coefficients of the others
//! fitted anew. Standard deviations come from the curvature there. Delays of several rows are whole rows, by which the
//! readings are moved, and a rest.

use super::ekf::innovations::run;
use super::fit::begin::start;
use super::fit::evidence::Coefficients;
use super::fit::{Compared, Theta};
use super::holdout;
use super::model_selection::mounting;
use super::preprocess::changepoint;
use super::preprocess::clocks;
use super::preprocess::hypothesis::PreprocessingHypothesis;
use super::preprocess::lost_ticks;
use super::preprocess::lost_ticks::{LostTicks, Sought, missed_part};
use super::preprocess::noise_levels::lattice_part;
use super::preprocess::sensor_offset::lags;
use super::record::Record;
use super::regressors::candidates::{self, Candidates, knowable};
use crate::config::{Config, Kind};
use crate::effects::drive::{Coordinate, DriveExplanation, Driving};
use crate::effects::{self, About, InDrives, Library, Parameters};
use crate::error::{Error, ErrorKind, Result};
use crate::gap::asked;
use crate::gap::diagnosis::Drive;
use crate::gap::drive::ekf::noise::Noise;
use crate::gap::drive::fit::models_at;
use crate::gap::drive::options::{Options, WORTH};
use crate::gap::drive::preprocess::initial_noise::InitialNoise;
use crate::gap::rest::explain::{Explained, Explanations, told};
use crate::gap::selection::sets::Part;
use crate::math::NORMAL_975;
use crate::signal::Log;

/// Rounds of the search for lost ticks, each with the model fitted by then.
const SOUGHT: usize = 2;

/// Effects that are asked for.
struct Asked {
    drives: Vec<&'static dyn Driving>,
    /// The random walk of the gyro's bias; none where it is not asked for.
    walk: Option<&'static About>,
}

impl Asked {
    /// # Errors
    /// As [`asked::check`].
    fn of(library: &Library, ids: &[&str]) -> Result<Self> {
        let walk = effects::in_drives(InDrives::Walk);
        let known: Vec<_> = library.driving().map(|e| e.about().id).chain(walk.map(|w| w.id)).collect();
        asked::check("effects", ids, &known, Kind::Driving)?;
        let drives = ids.iter().filter_map(|id| library.driving_by_id(id)).collect();
        Ok(Self { drives, walk: walk.filter(|w| ids.contains(&w.id)) })
    }

    /// # Errors
    /// [`ErrorKind::Column`] if the drive cannot show one of them.
    fn shown_by(&self, record: &Record, source: &str) -> Result<()> {
        let walk = self.walk.filter(|_| record.gyro_rad_s.is_none()).map(|w| w.id);
        let unseen = self.drives.iter().find(|e| !knowable(**e, record)).map(|e| e.about().id);
        match unseen.or(walk) {
            None => Ok(()),
            Some(id) => {
                let found = format!("nothing that would show {id}");
                Err(Error::new(ErrorKind::Column, source, found)
                    .hint("log the wheels' torques, the gyro or a pose beside the wheels, or leave the effect out"))
            }
        }
    }

    /// The first effect asked for whose explanation is `wanted`; none where there is none.
    fn first(&self, wanted: fn(&DriveExplanation) -> bool) -> Option<&'static dyn Driving> {
        self.drives.iter().copied().find(|e| wanted(&e.explanation()))
    }
}

/// Fit of given effects to a drive.
struct Fit {
    parts: Vec<Part>,
    /// Ids of effects whose best sizes lie outside of their bounds; notes tell them.
    outside: Vec<&'static str>,
    /// Noise that the nominal filter assumes; without torques, with the estimated diffusion and noise of wheels and
    /// gyro.
    nominal: Noise,
    notes: Vec<String>,
    /// ln p of the drive and θ̂, with the prior odds of the effects.
    ln_weight: f64,
}

/// Fits `ids` to a drive; see [`crate::gap::explain()`].
///
/// # Errors
/// As [`crate::gap::explain()`].
pub(crate) fn explain(
    config: &Config,
    log: &Log,
    library: &Library,
    ids: &[&str],
    since_power_on_s: f64,
) -> Result<Explanations> {
    let asked = Asked::of(library, ids)?;
    let given = [Drive::new(log, since_power_on_s)];
    let clocks = clocks::agree(config, &given, &[])?;
    let [set, _] = clocks.drives(&given, &[]);
    let record = Record::of_drives(config, &set)?;
    asked.shown_by(&record, &log.source)?;
    let (effects, options) = (library.driving().collect::<Vec<_>>(), Options::default());
    let mounting = mounting(&record, &effects, &options);
    let record = mounting.as_ref().map_or_else(|| record.clone(), |m| m.taken_out(&record));
    let mut fit = fit(&record, &asked, &options);
    let about = |id: &str| {
        library.driving_by_id(id).map(Driving::about).or_else(|| library.by_id(id).map(effects::Effect::about))
    };
    let mut effects: Vec<Explained> = fit.parts.iter().filter_map(|part| Some(told(about(&part.id)?, part))).collect();
    effects.sort_by_key(|e| ids.iter().position(|id| *id == e.id));
    let is_told = |id: &str| effects.iter().any(|e| e.id == id) || fit.outside.contains(&id);
    fit.notes.extend(ids.iter().filter(|id| !is_told(id)).map(|id| format!("{id}: the recording has no trace of it.")));
    let notes =
        record.notes.iter().chain(&clocks.notes).cloned().chain(mounting.map(|m| m.said())).chain(fit.notes).collect();
    Ok(Explanations { effects, notes })
}

/// Gain on `hold` over the nominal simulator of the effects `ids`, fitted to `fit_log`, in nats a row: the gain of an
/// oracle that is told the effects.
///
/// # Errors
/// As [`explain`].
pub(in crate::gap) fn known_gain(
    config: &Config,
    fit_log: &Log,
    hold: &Log,
    library: &Library,
    ids: &[&str],
) -> Result<f64> {
    let asked = Asked::of(library, ids)?;
    let (effects, options) = (library.driving().collect::<Vec<_>>(), Options::default());
    let record = Record::new(config, fit_log, 0.0)?;
    asked.shown_by(&record, &fit_log.source)?;
    let kept = Record::new(config, hold, 0.0)?;
    let (record, kept) = match mounting(&record, &effects, &options) {
        Some(m) => (m.taken_out(&record), m.taken_out(&kept)),
        None => (record, kept),
    };
    let fit = fit(&record, &asked, &options);
    let found: Vec<(String, Parameters)> = fit.parts.into_iter().map(|p| (p.id, p.parameters)).collect();
    Ok(holdout::gain(&kept.with_levels_of(&fit.nominal), library, &found, fit.nominal.process))
}

/// Fits what is asked for to the drive as it is, and with the readings of an instrument moved earlier by the whole rows by
/// which they may be late; the most probable.
fn fit(record: &Record, asked: &Asked, options: &Options) -> Fit {
    let initial = InitialNoise::of(record);
    let lags = lags(record, &initial.noise, &asked.drives);
    let as_is = in_place(record, &initial, asked, options);
    let moved = lags.into_iter().filter_map(|lag| {
        let earlier = record.earlier(lag.of, lag.rows);
        let moved = in_place(&earlier, &InitialNoise::of(&earlier), asked, options);
        // a rest that it cannot have speaks against these rows
        let rest = moved.parts.iter().position(|p| p.id == lag.late.id)?;
        Some((lag, moved, rest))
    });
    match moved.max_by(|a, b| a.1.ln_weight.total_cmp(&b.1.ln_weight)) {
        Some((lag, mut moved, rest)) if moved.ln_weight > as_is.ln_weight => {
            let drives = asked.drives.iter().copied().filter(|e| e.about().id != lag.late.id).collect();
            let without = in_place(record, &initial, &Asked { drives, walk: asked.walk }, options);
            let part = &mut moved.parts[rest];
            part.share = moved.ln_weight - without.ln_weight - options.prior.ln_named;
            *part.parameters.entry(lag.late.size().into()).or_insert(0.0) += lag.rows as f64 * record.step_s;
            moved
        }
        _ => as_is,
    }
}

/// Fits what is asked for to the drive, its rows as they are.
fn in_place(record: &Record, initial: &InitialNoise, asked: &Asked, options: &Options) -> Fit {
    let InitialNoise { lsb, noise, nominal } = *initial;
    let every = Candidates::new(record, &asked.drives, &options.prior, false, &changepoint::of_each(record));
    let candidates = every.only(|g| asked.walk.is_some() || !matches!(every.kinds[g], candidates::Kind::Walk));
    let mut notes = Vec::new();
    let mut parts = Vec::new();
    let mut as_is =
        PreprocessingHypothesis::new(record.clone(), noise, settled(record, &noise, &candidates), Vec::new());
    // torque noise within a step, and diffusion without torques, were estimated by the model without the effects
    if as_is.ripple() | as_is.diffuse() {
        as_is.compared = settled(record, &as_is.noise, &candidates);
    }
    let noise = as_is.noise;
    let nominal = noise.nominal_beside(&nominal, record);
    // single bursts, where they explain more than a wheel that reads low on average
    let lost = asked.first(|e| matches!(e, DriveExplanation::MissedTicks(_))).and_then(|effect| {
        let others = settled(record, &noise, &candidates.without_lost_ticks());
        let on_average = as_is.compared.top() - others.top();
        Some((effect, lost_ticks(record, &noise, &others).filter(|lost| lost.3 > on_average)?))
    });
    let mut branch = match lost {
        Some((effect, (restored, compared, bursts, gained))) => {
            parts.push(missed_part(effect, &bursts, gained));
            PreprocessingHypothesis::new(restored, noise, compared, Vec::new())
        }
        None => as_is,
    };
    if asked.first(|e| matches!(e, DriveExplanation::NoiseLevel(_))).is_some() {
        let residuals = branch.residuals();
        if branch.level(&asked.drives, options, &residuals) {
            branch.compared = settled(&branch.record, &branch.noise, &branch.compared.candidates);
        }
        branch.tell_levels();
        let is_asked = |p: &&Part| asked.drives.iter().any(|e| e.about().id == p.id);
        parts.extend(branch.extra_parts.iter().filter(is_asked).cloned());
    }
    let c = &branch.compared;
    let members = &c.sets[0].fitted;
    let coefficients = c.problem.coefficients(members);
    let mut ids_outside = Vec::new();
    for (i, &(group, _)) in members.iter().enumerate() {
        if let Some((id, note)) = outside(c, group, &coefficients) {
            ids_outside.push(id);
            notes.push(note);
            continue;
        }
        let others: Vec<_> = members.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, m)| *m).collect();
        let gain = c.problem.ln_evidence(members) - c.problem.ln_evidence(&others);
        parts.push(branch.part(group, gain, &coefficients));
    }
    if let Some(effect) = asked.first(|e| matches!(e, DriveExplanation::WheelLattice))
        && let Some(lsb) = lsb
    {
        let gained = branch.ln_likelihood(&noise) - branch.ln_likelihood(&nominal);
        parts.push(lattice_part(lsb, gained, Some(effect.about())));
    }
    if !c.next().1 {
        notes.push("The parameters had not settled when the fit was ended: their intervals may be too narrow.".into());
    }
    let ln_weight = c.top();
    Fit { parts, outside: ids_outside, nominal, notes, ln_weight }
}

/// Id of, and note on, an effect whose coefficients, fitted freely, leave their bounds by more than they are uncertain; else none.
fn outside(c: &Compared, group: usize, coefficients: &Coefficients) -> Option<(&'static str, String)> {
    let candidates::Kind::Change(i) = c.candidates.kinds[group] else { return None };
    let (effect, change) = c.candidates.changes[i];
    let columns = &c.candidates.groups[group].columns;
    let told: Vec<(f64, f64)> =
        columns.iter().filter_map(|column| coefficients.iter().find(|c| c.0 == *column)).map(|c| (c.1, c.2)).collect();
    let beyond = |((value, std), own): (&(f64, f64), &Coordinate)| {
        *value < own.bounds[0] - NORMAL_975 * std || *value > own.bounds[1] + NORMAL_975 * std
    };
    told.iter().zip(change.coordinates()).any(beyond).then(|| {
        let free: Vec<f64> = told.iter().map(|t| t.0).collect();
        let about = effect.about();
        let (name, value) = (about.size(), change.parameters(&free).get(about.size()).copied().unwrap_or(free[0]));
        (about.id, format!("{}: it would take {name} = {value:.3e}, a value that it cannot have.", about.id))
    })
}

/// All candidates fitted together: from zero, from the start for strongly nonlinear changes, and from the fit of each
/// alone.
fn settled(record: &Record, noise: &Noise, candidates: &Candidates) -> Compared {
    let zero = candidates.zero();
    let begin = start(record, noise, candidates);
    let mut starts: Vec<Theta> = vec![zero.clone()];
    if begin != zero {
        starts.push(begin);
    }
    let changes: Vec<usize> =
        (0..candidates.kinds.len()).filter(|g| matches!(candidates.kinds[*g], candidates::Kind::Change(_))).collect();
    if candidates.kinds.len() > 1 {
        let alone = |g: usize| Compared::all_in(record, noise, candidates.only(|x| x == g), zero.clone()).next().0;
        starts.extend(changes.into_iter().map(alone));
    }
    let mut ends = starts.into_iter().map(|from| Compared::all_in(record, noise, candidates.clone(), from));
    let first = ends.next().unwrap_or_else(|| Compared::all_in(record, noise, candidates.clone(), zero));
    ends.fold(first, |best, end| if end.top() > best.top() { end } else { best })
}

/// The drive with the lost ticks of one wheel restored, the fit to it, the bursts, and their gain in ln likelihood,
/// nats; none where no account of bursts has evidence.
fn lost_ticks(record: &Record, noise: &Noise, as_is: &Compared) -> Option<(Record, Compared, LostTicks, f64)> {
    let candidates = &as_is.candidates;
    let mut theta = as_is.next().0;
    let mut found: Option<(Record, Compared, LostTicks, f64)> = None;
    for round in 0..SOUGHT {
        let models = models_at(record, candidates, &theta);
        // slow errors are taken out only in the first round: a model with the ticks restored has none
        let sought = [0, 1].iter().flat_map(|side| [true, false].map(|slow| Sought { side: *side, loss: None, slow }));
        let accounts = sought
            .filter(|s| round == 0 || !s.slow)
            .flat_map(|s| lost_ticks::accounts(record, &models, noise, s))
            .filter(|b| b.ln_evidence > WORTH);
        let weighed = accounts.map(|b| (lost_ticks::weight(record, &models, noise, &b), b));
        let Some((_, bursts)) = weighed.max_by(|a, b| a.0.total_cmp(&b.0)) else { break };
        let restored = bursts.restored(record);
        let compared = Compared::all_in(&restored, noise, candidates.clone(), theta.clone());
        let plain = run(record, &models_at(record, candidates, &as_is.theta), noise, &[], |_| {});
        let with = run(&restored, &models_at(&restored, candidates, &compared.theta), noise, &[], |_| {});
        let gained = with.ln_likelihood() + bursts.ln_path + bursts.ln_jacobian() - plain.ln_likelihood();
        theta = compared.next().0;
        if found.as_ref().is_none_or(|f| gained > f.3) {
            found = Some((restored, compared, bursts, gained));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::drive::ids;
    use crate::gap::drive::preprocess::torque_bandwidth;
    use crate::gap::drive::preprocess::torque_bandwidth::tests::shaken;

    /// A large gyro gain looks like torque noise within a step: gyro and heading diverge.
    #[test]
    fn how_torques_change_within_a_step_is_judged_with_the_effects() {
        const GAIN: f64 = 0.2;
        let library = Library::new();
        for (parts, whole) in [(1, 0.0), (16, 1.0)] {
            let mut record = shaken(parts, 11);
            record.gyro_rad_s.iter_mut().flatten().for_each(|w| *w *= 1.0 + GAIN);
            let before = torque_bandwidth::before(&record, &Noise::believed(&record, None)).process.ripple;
            let fit = fit(&record, &Asked::of(&library, &[ids::scale_factor()]).unwrap(), &Options::default());
            let all = record.belief.torque_noise_n_m_sqrt_s.powi(2);
            assert!(before > 0.0);
            assert_eq!(fit.nominal.process.ripple, whole * all);
            let (k, std) = (fit.parts[0].parameters["relative"], fit.parts[0].std["relative"]);
            assert!((k - GAIN).abs() < 5.0 * std, "{k} {std}");
        }
    }

    /// Rates are extrapolated over a delay: over several rows that is an error of a row.
    #[test]
    #[ignore = "battery: some seconds"]
    fn battery_delays_of_several_rows_are_right_beside_a_gain() {
        use crate::gap::drive::preprocess::clocks::tests::{recorded, robot, without};
        use crate::signal::names;
        let both = [(ids::gyro_delay(), "delay_s", 0.05), (ids::scale_factor(), "relative", 0.05)];
        let log = recorded(25.0, 3, both);
        for log in [log.clone(), without(log, &[names::TORQUE_LEFT, names::TORQUE_RIGHT])] {
            let record = Record::new(&robot(), &log, 0.0).unwrap();
            let asked = Asked::of(&Library::new(), &both.map(|e| e.0)).unwrap();
            let fit = fit(&record, &asked, &Options::default());
            for (id, name, truth) in both {
                let part = fit.parts.iter().find(|p| p.id == id).unwrap();
                let (found, std) = (part.parameters[name], part.std[name]);
                assert!((found - truth).abs() < 4.0 * std && std < 0.01 * truth, "{id}: {found} ± {std}");
                assert!(part.share > 100.0, "{id}: {}", part.share);
            }
        }
    }

    /// A wheel that reads high has not lost ticks: nothing is gained by a loss that is no loss.
    #[test]
    fn a_size_that_an_effect_cannot_have_gains_nothing() {
        use crate::gap::drive::preprocess::acceleration_model::tests::{belief, recorded};
        use crate::math::random::Stream;
        let belief = belief();
        let draw = &mut Stream::new(3, 1);
        let motion: Vec<[f64; 2]> = (0..3000).map(|k| [0.5, (0.01 * f64::from(k)).sin()]).collect();
        let wheel = |side: usize, factor: f64, draw: &mut Stream| -> Vec<f64> {
            let reads = |[v, w]: &[f64; 2]| factor * belief.robot.wheels_rad_s(*v, *w)[side];
            motion.iter().map(|m| reads(m) + belief.wheel_std_rad_s * draw.normal()).collect()
        };
        let gyro: Vec<f64> = motion.iter().map(|m| m[1] + belief.gyro_std_rad_s * draw.normal()).collect();
        for (factor, gains) in [(0.97, true), (1.03, false)] {
            let record = recorded(belief, 0.02, [wheel(0, factor, draw), wheel(1, 1.0, draw)], gyro.clone());
            let asked = Asked::of(&Library::new(), &[ids::missed_ticks()]).unwrap();
            let fit = fit(&record, &asked, &Options::default());
            assert_eq!(fit.parts.iter().any(|p| p.share > 100.0), gains, "{:?}", fit.parts);
            assert_eq!(
                fit.notes.iter().any(|n| n.ends_with("a value that it cannot have.")),
                !gains,
                "{:?}",
                fit.notes
            );
        }
    }
}
