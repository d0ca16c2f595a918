//! θ ← θ + posterior mean of the linearised difference, until it settles; sets are compared at every step
//!
//! Gauss-Newton over the coordinates of model changes. Wide steps, with the columns of every candidate, choose the set;
//! narrow steps, with those of the named effects and of the set, settle its coordinates.

pub(crate) mod begin;

pub(crate) mod evidence;
pub(crate) mod form;
pub(crate) mod leave_out;
pub(crate) mod search;
use self::evidence::{Coefficients, Problem};
use self::search::{WeighedMembers, best as best_set, search};
use super::ekf::innovations::run_scoped;
use super::preprocess::changepoint::{Onsets, or};
use super::record::Record;
use super::regressors::basis::{Column, Equation, Follows, Scoped};
use super::regressors::candidates::{Candidates, Kind};
use crate::effects::drive::{Driving, ModelChange};
use crate::gap::drive::ekf::models::{Beside, Models};
use crate::gap::drive::ekf::noise::Noise;
use crate::gap::selection::search::Member;
use crate::model::drive::DriveEffect;
use faer::Mat;
use std::collections::{BTreeMap, BTreeSet};

/// Coordinates θ of every change, by change and coordinate.
pub(crate) type Theta = Vec<Vec<f64>>;

/// Most narrow steps after a wide one.
const NARROW: usize = 6;
/// Most steps where the members of the set are known.
const TOGETHER: usize = 12;
/// Narrow steps before a model that explains far less than another is given up.
const PATIENT: usize = 1;
/// Largest move of a coordinate that counts as settled, in its standard deviations.
const SETTLED: f64 = 0.15;
/// Least change of the best set's ln weight by an effect that remains a candidate in narrow steps, nats.
const FUTILE: f64 = -6.0;
/// Evidence that a step may lose before it is halved, nats.
const LOSS: f64 = 3.0;

/// ln weight below which a climb is given up, and when.
#[derive(Clone, Copy)]
enum Hopeless {
    /// Never.
    Never,
    /// After some steps.
    Soon(f64),
    /// Where a step leads beyond the range of the linearisation.
    WhereHalved(f64),
}

/// A linearisation, and the sets that were compared there.
pub(crate) struct Compared {
    /// Coordinates at which it was linearised.
    pub theta: Theta,
    /// Candidates and their columns.
    pub candidates: Candidates,
    /// Normal equations there.
    pub problem: Problem,
    /// Sets, the most probable first.
    pub sets: Vec<WeighedMembers>,
}

/// The model with the changes of `candidates` at θ.
pub(crate) fn models_at(record: &Record, candidates: &Candidates, theta: &Theta) -> Models {
    models(record, &candidates.change_list(), theta, false)
}

/// The model at θ and, if `slopes`, the models moved by a step in each coordinate that has a column.
#[must_use]
pub(crate) fn models(record: &Record, changes: &[&'static dyn ModelChange], theta: &Theta, slopes: bool) -> Models {
    Models::of_each_load(record, |load_kg| models_carrying(record, load_kg, changes, theta, slopes))
}

fn models_carrying(
    record: &Record,
    load_kg: f64,
    changes: &[&'static dyn ModelChange],
    theta: &Theta,
    slopes: bool,
) -> Models {
    let at_work =
        |theta: &Theta| -> Vec<usize> { (0..changes.len()).filter(|i| theta[*i].iter().any(|v| *v != 0.0)).collect() };
    let build = |theta: &Theta| {
        let effects: Vec<Box<dyn DriveEffect>> = at_work(theta).into_iter().map(|i| changes[i].at(&theta[i])).collect();
        record.model(load_kg, effects)
    };
    let here = build(theta);
    let given = record.given.len();
    let there = at_work(theta);
    let mut beside = Vec::new();
    if slopes {
        for (i, change) in changes.iter().enumerate() {
            let one = change.coordinates().iter().chain(change.departures()).enumerate().map(|(j, c)| {
                let step = 1e-3 * c.scale[0].max(0.05 * theta[i][j].abs());
                let mut moved = theta.clone();
                moved[i][j] += step;
                let model = build(&moved);
                // given effects stand before them
                let alike = |place: &usize| model.pushes_alike(*place, &here.robot);
                let known = |(place, own): (usize, &usize)| {
                    let same = there.iter().position(|c| c == own).filter(|_| *own != i)?;
                    Some(given + same).filter(|_| alike(&(given + place)))
                };
                let there = at_work(&moved);
                let same = (0..given).map(|place| Some(place).filter(alike));
                let known = same.chain(there.iter().enumerate().map(known)).collect();
                let own = there.iter().position(|c| *c == i).map(|place| given + place).filter(alike);
                Beside { model, step, touches: change.touches(), known, own }
            });
            beside.push(one.collect());
        }
    }
    Models::alone(here, beside)
}

impl Candidates {
    /// The model changes alone.
    #[must_use]
    pub(crate) fn change_list(&self) -> Vec<&'static dyn ModelChange> {
        self.changes.iter().map(|c| c.1).collect()
    }

    /// θ at zero.
    #[must_use]
    pub(crate) fn zero(&self) -> Theta {
        self.changes.iter().map(|c| vec![0.0; c.1.coordinates().len() + c.1.departures().len()]).collect()
    }

    /// θ with all changes of this effect at zero.
    #[must_use]
    pub(crate) fn without(&self, id: &str, theta: &Theta) -> Theta {
        self.at_zero(|effect| effect.about().id == id, theta)
    }

    /// θ with the mean losses of ticks at zero.
    #[must_use]
    pub(crate) fn without_lost_ticks_in(&self, theta: &Theta) -> Theta {
        self.at_zero(|effect| effect.tick_loss().is_some(), theta)
    }

    fn at_zero(&self, which: impl Fn(&dyn Driving) -> bool, theta: &Theta) -> Theta {
        let mut out = theta.clone();
        for (values, (effect, _)) in out.iter_mut().zip(&self.changes) {
            if which(*effect) {
                values.fill(0.0);
            }
        }
        out
    }

    fn here(&self, theta: &Theta) -> Vec<f64> {
        let value = |c: &Scoped| match c.column {
            Column::Coordinate(i, j) => theta[i][j],
            _ => 0.0,
        };
        self.columns.iter().map(value).collect()
    }

    /// θ of a set: its coefficients, inside their bounds; zero for changes outside the set. Also whether it has
    /// settled, close to `before`.
    #[must_use]
    pub(crate) fn theta_of(&self, members: &[Member], coefficients: &Coefficients, before: &Theta) -> (Theta, bool) {
        let mut theta = self.zero();
        let mut settled = true;
        for &(g, _) in members {
            let Kind::Change(i) = self.kinds[g] else { continue };
            for (j, column) in self.groups[g].columns.iter().enumerate() {
                let Some((_, mean, std)) = coefficients.iter().find(|c| c.0 == *column) else { continue };
                let [low, high] = self.changes[i].1.coordinates()[j].bounds;
                theta[i][j] = mean.clamp(low, high);
                settled &= (theta[i][j] - before[i][j]).abs() <= SETTLED * std + 1e-12;
            }
        }
        // a change that left the set has moved too
        for (new, old) in theta.iter().zip(before) {
            settled &= new.iter().any(|v| *v != 0.0) || old.iter().all(|v| *v == 0.0);
        }
        (theta, settled)
    }

    /// Columns of the set's changes, with their values at θ.
    fn pinned(&self, members: &[Member], theta: &Theta) -> Vec<(usize, f64)> {
        let of = |m: &Member| match self.kinds[m.0] {
            Kind::Change(i) => self.groups[m.0].columns.iter().copied().zip(theta[i].iter().copied()).collect(),
            _ => Vec::new(),
        };
        members.iter().flat_map(of).collect()
    }

    /// Normal equations of one pass of the filter at θ.
    #[must_use]
    pub(crate) fn linearise(&self, record: &Record, noise: &Noise, theta: &Theta) -> Problem {
        let models = models(record, &self.change_list(), theta, true);
        let summed = run_scoped(record, &models, noise, &self.columns, |_| {});
        self.problem(&summed.gram, summed.ln_volume, theta)
    }

    fn problem(&self, gram: &Mat<f64>, ln_volume: f64, theta: &Theta) -> Problem {
        let groups = self.scaled(|c| gram[(c, c)]);
        Problem::new(gram, ln_volume, &self.here(theta), groups, self.nuisance.clone())
    }

    /// Time of the bias step among `groups` in each drive, s since that drive began.
    #[must_use]
    pub(crate) fn steps_of(&self, groups: impl IntoIterator<Item = usize>) -> Onsets {
        let mut steps = Onsets::new();
        for g in groups {
            let Kind::Step(drive, t) = self.kinds[g] else { continue };
            steps.resize(steps.len().max(drive + 1), None);
            steps[drive] = steps[drive].or(Some(t));
        }
        steps
    }
}

impl Compared {
    /// Compares the sets of `candidates`, linearised at `theta`.
    #[must_use]
    pub(crate) fn wide(record: &Record, noise: &Noise, candidates: Candidates, theta: Theta) -> Self {
        let problem = candidates.linearise(record, noise, &theta);
        let sets = search(&problem);
        Self { theta, candidates, problem, sets }
    }

    /// Settles θ for the best set of `candidates`, which may change at every step. Gives up after some steps if its ln
    /// weight is still below `hopeless`.
    #[must_use]
    pub(crate) fn narrow(
        record: &Record,
        noise: &Noise,
        candidates: Candidates,
        from: Theta,
        hopeless: Option<f64>,
    ) -> Self {
        let hopeless = hopeless.map_or(Hopeless::Never, Hopeless::Soon);
        Self::climb(record, noise, candidates, (from, None), NARROW, hopeless, best_set)
    }

    /// Settles θ for all groups of `candidates` together; of groups with one id, only the one that explains most.
    #[must_use]
    pub(crate) fn all_in(record: &Record, noise: &Noise, candidates: Candidates, from: Theta) -> Self {
        Self::climb(record, noise, candidates, (from, None), TOGETHER, Hopeless::Never, Problem::together)
    }

    /// [`Self::narrow`] from here, for a part of the same candidates.
    #[must_use]
    pub(crate) fn narrowed(&self, record: &Record, noise: &Noise, few: Candidates) -> Self {
        let from = (self.theta.clone(), Some(self.within(&few)));
        Self::climb(record, noise, few, from, NARROW, Hopeless::Never, best_set)
    }

    /// [`Self::all_in`] from here, for a part of the same candidates. Gives up where a step has to be halved while the
    /// ln weight is below `hopeless`.
    #[must_use]
    pub(crate) fn together(&self, record: &Record, noise: &Noise, few: Candidates, hopeless: f64) -> Self {
        let from = (self.theta.clone(), Some(self.within(&few)));
        Self::climb(record, noise, few, from, TOGETHER, Hopeless::WhereHalved(hopeless), Problem::together)
    }

    /// Normal equations of a part of the candidates, without another pass.
    fn within(&self, few: &Candidates) -> Problem {
        let place = |column: &Scoped| self.candidates.columns.iter().position(|c| c == column);
        let columns: Vec<usize> = few.columns.iter().filter_map(place).collect();
        let (gram, ln_volume) = self.problem.summed_of(&columns);
        few.problem(&gram, ln_volume, &self.theta)
    }

    fn climb(
        record: &Record,
        noise: &Noise,
        candidates: Candidates,
        (from, mut known): (Theta, Option<Problem>),
        steps: usize,
        hopeless: Hopeless,
        choose: impl Fn(&Problem) -> WeighedMembers,
    ) -> Self {
        let mut best: Option<Self> = None;
        let mut theta = from;
        for step in 0..steps {
            let problem = known.take().unwrap_or_else(|| candidates.linearise(record, noise, &theta));
            let top = choose(&problem);
            if best.is_none() && !top.ln_weight.is_finite() {
                // the filter diverges at the start: nearer to the nominal model it does not
                theta.iter_mut().flatten().for_each(|coordinate| *coordinate *= 0.5);
                continue;
            }
            if let Some(best) = &best
                && !(top.ln_weight.is_finite() && best.gained(&problem, &theta) >= -LOSS)
            {
                // beyond the range of the linearisation
                if matches!(hopeless, Hopeless::WhereHalved(least) if best.sets[0].ln_weight < least) {
                    break;
                }
                for (new, old) in theta.iter_mut().flatten().zip(best.theta.iter().flatten()) {
                    *new = 0.5 * (*new + old);
                }
                continue;
            }
            let here = Self { theta, candidates: candidates.clone(), problem, sets: vec![top] };
            let (next, settled) = here.next();
            let given_up =
                step >= PATIENT && matches!(hopeless, Hopeless::Soon(least) if here.sets[0].ln_weight < least);
            theta = next;
            best = Some(here);
            if settled || given_up {
                break;
            }
        }
        best.unwrap_or_else(|| Self::wide(record, noise, candidates, theta))
    }

    /// Gain in ln density of the best set at θ `there`, where `problem` was linearised: the actual gain of a step, not
    /// the predicted one.
    fn gained(&self, problem: &Problem, there: &Theta) -> f64 {
        let members = &self.sets[0].fitted;
        let density = |problem: &Problem, theta| problem.ln_density(members, &self.candidates.pinned(members, theta));
        density(problem, there) - density(&self.problem, &self.theta)
    }

    /// ln weight of the best set; `f64::MIN` where the filter has diverged.
    #[must_use]
    pub(crate) fn top(&self) -> f64 {
        if self.has_diverged() { f64::MIN } else { self.sets[0].ln_weight }
    }

    /// Whether its best set has no free form.
    pub(crate) fn is_named(&self) -> bool {
        self.sets[0].fitted.iter().all(|m| self.candidates.groups[m.0].named)
    }

    /// Whether the filter has diverged where this was linearised.
    #[must_use]
    pub(crate) fn has_diverged(&self) -> bool {
        !self.sets[0].ln_weight.is_finite()
    }

    /// θ of the best set, and whether it is close to where this was linearised.
    #[must_use]
    pub(crate) fn next(&self) -> (Theta, bool) {
        let members = &self.sets[0].fitted;
        self.candidates.theta_of(members, &self.problem.coefficients(members), &self.theta)
    }

    /// Time of the bias step in each drive in the best set, s since the drive began; where a walk or a function of time
    /// takes its place, the most likely time of a step.
    #[must_use]
    pub(crate) fn steps_s(&self) -> Onsets {
        let members = &self.sets[0].fitted;
        let there = self.candidates.steps_of(members.iter().map(|m| m.0));
        if members.iter().any(|m| self.is_slow(m)) {
            return or(there, &self.candidates.steps_of(self.likely_steps()));
        }
        there
    }

    /// Group of the bias step in each drive that explains most beside the rest of the best set.
    #[must_use]
    pub(crate) fn likely_steps(&self) -> Vec<usize> {
        let drive = |m: &Member| match self.candidates.kinds[m.0] {
            Kind::Step(drive, _) => Some(drive),
            _ => None,
        };
        let members = self.sets[0].fitted.iter().copied();
        let rest: Vec<Member> = members.filter(|m| !self.is_slow(m) && drive(m).is_none()).collect();
        let mut best: BTreeMap<usize, (usize, f64)> = BTreeMap::new();
        for (member, gain) in self.problem.additions(&rest) {
            let Some(drive) = drive(&member) else { continue };
            let one = best.entry(drive).or_insert((member.0, gain));
            if gain.total_cmp(&one.1).is_ge() {
                *one = (member.0, gain);
            }
        }
        best.into_values().map(|b| b.0).collect()
    }

    /// Whether it can replace a bias step: a random walk, or a function of time on the gyro.
    fn is_slow(&self, member: &Member) -> bool {
        matches!(self.candidates.kinds[member.0], Kind::Walk | Kind::Free(Equation::Gyro, Follows::Time))
    }

    /// ln weight of the best set over that of the empty set, nats.
    #[must_use]
    pub(crate) fn gap(&self) -> f64 {
        self.top() - self.problem.ln_weight(&[])
    }

    /// Ids of the members of the best set, and of the free forms and varying coefficients that add most to it.
    #[must_use]
    pub(crate) fn promising(&self, most: usize) -> BTreeSet<String> {
        let members = &self.sets[0].fitted;
        let id = |m: &Member| self.candidates.groups[m.0].id.clone();
        let mut added = self.problem.additions(members);
        added.retain(|(m, _)| !self.candidates.groups[m.0].named);
        added.sort_by(|a, b| b.1.total_cmp(&a.1));
        members.iter().chain(added.iter().take(most).map(|a| &a.0)).map(id).collect()
    }

    /// Groups of the best set, and named effects that may yet enter it.
    #[must_use]
    pub(crate) fn plausible(&self) -> Candidates {
        let members = &self.sets[0].fitted;
        let candidates = &self.candidates;
        let mut keep: Vec<usize> = members.iter().map(|m| m.0).collect();
        let may = |((g, _), gain): &(Member, f64)| {
            *gain > FUTILE && candidates.groups[*g].named && !matches!(candidates.kinds[*g], Kind::Step(..))
        };
        keep.extend(self.problem.additions(members).into_iter().filter(may).map(|(m, _)| m.0));
        candidates.only(|g| keep.contains(&g))
    }
}
