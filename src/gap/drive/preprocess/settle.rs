//! A hypothesis is settled: sets are compared where the best one lies, outliers removed, noise levels estimated, and
//! each effect left out, until nothing changes

use crate::effects::drive::Driving;
use crate::gap::drive::ekf::noise::Noise;
use crate::gap::drive::fit::form::most_form_nats;
use crate::gap::drive::fit::{Compared, Theta, models_at};
use crate::gap::drive::options::{LARGE, Options};
use crate::gap::drive::preprocess::acceleration_model;
use crate::gap::drive::preprocess::changepoint;
use crate::gap::drive::preprocess::changepoint::Onsets;
use crate::gap::drive::preprocess::hypothesis::PreprocessingHypothesis;
use crate::gap::drive::preprocess::torque_bandwidth;
use crate::gap::drive::record::Record;
use crate::gap::drive::regressors::candidates::{Candidates, Kind};
use crate::gap::selection::search::Member;
use crate::gap::trace::{Decision, Step, TraceStage};

/// Most comparisons of all sets.
const WIDE: usize = 3;
/// Gain needed to change the diffusion, nats.
const BETTER: f64 = 1.0;
/// Free forms that are retained in a large gap.
const PROMISING: usize = 20;

impl PreprocessingHypothesis {
    /// Removes outliers, estimates noise levels from the remaining residuals, and settles again if there were any;
    /// returns that.
    pub(crate) fn clean(&mut self, effects: &[&'static dyn Driving], options: &Options) -> bool {
        let shaken = self.shake();
        let residuals = self.residuals();
        let any = self.put_outliers_aside(options, &residuals);
        // residuals without the outliers
        let residuals = if any { self.residuals() } else { residuals };
        let changed = shaken | any | self.level(effects, options, &residuals) | self.diffuse() | self.ripple();
        if changed {
            let (candidates, from) = (self.compared.plausible(), self.onward());
            self.compared = Compared::narrow(&self.record, &self.noise, candidates, from, None);
        }
        changed
    }

    /// Without torques: estimates diffusion and noise of wheels and gyro from a settled model; returns whether that
    /// changed them. Gains of gyro and wheels scale all speeds, and would make up for a diffusion that still includes
    /// the gap.
    pub(crate) fn diffuse(&mut self) -> bool {
        if self.record.torques_n_m.is_some() {
            return false;
        }
        let (candidates, theta) = (&self.compared.candidates, &self.compared.theta);
        let changed =
            acceleration_model::likely(&self.record, &models_at(&self.record, candidates, theta), &self.noise);
        let gained = self.ln_likelihood(&changed) - self.ln_likelihood(&self.noise);
        let better = gained > BETTER;
        if better {
            self.noise = changed;
            let reason = "without torques: how speeds change, and noise levels, estimated beside the best set; nats of the last round";
            let step = Step::new(TraceStage::Readings, "diffusion of the speeds", Decision::Estimated, reason);
            self.note(step.nats(gained).limit("least gain to be taken", BETTER, "nats"));
        }
        better
    }

    /// Estimates the torque noise within a step from a settled model; returns whether that changed it.
    pub(crate) fn ripple(&mut self) -> bool {
        let likely = torque_bandwidth::likely(&self.record, &self.noise, |noise| self.weigh(noise));
        std::mem::replace(&mut self.noise, likely) != likely
    }

    /// Estimates the torque noise that the best set passes to the wheels' readings; returns whether there is any.
    fn shake(&mut self) -> bool {
        let found = self.at_rims(&self.record, &self.noise);
        if let Some((noise, gained)) = found {
            self.noise = noise;
            let reason = "wheels that slip are shaken by it: its share estimated beside the best set";
            let step = Step::new(TraceStage::Readings, "torque noise at the rims", Decision::Estimated, reason);
            let least = torque_bandwidth::BETTER + most_form_nats(self.bent_nats_beside(""));
            self.note(step.nats(gained).limit("least gain to be taken", least, "nats"));
        }
        found.is_some()
    }

    /// `noise` with the torque noise that the best set passes to the readings of `record`, and its gain, nats; none where it
    /// passes none.
    fn at_rims(&self, record: &Record, noise: &Noise) -> Option<(Noise, f64)> {
        let c = &self.compared;
        let passes = |m: &Member| match c.candidates.kinds[m.0] {
            Kind::Change(i) => c.candidates.changes[i].1.torque_noise_share().is_some(),
            _ => false,
        };
        if record.torques_n_m.is_none() || !c.sets[0].fitted.iter().any(passes) {
            return None;
        }
        // in a gap of another cause the law is far from right, and so is its noise
        let form_nats = most_form_nats(self.bent_nats_beside(""));
        torque_bandwidth::at_rims(record, noise, form_nats, |noise| self.weigh_in(record, noise))
    }

    /// `believed` with the torque noise that the best set passes to the readings of `record`, where that was not estimated yet.
    pub(crate) fn shaken_from(&self, record: &Record, believed: &Noise) -> Option<Noise> {
        if self.noise.process.at_rims > 0.0 {
            return None;
        }
        self.at_rims(record, believed).map(|(noise, _)| noise)
    }

    /// Compares all sets where the best one lies; in a large gap, of the free forms only those that are retained.
    pub(crate) fn widen(&mut self, effects: &[&'static dyn Driving], options: &Options, near_s: Onsets) {
        let near_s = changepoint::or(near_s, &self.onsets_s);
        let mut candidates = Candidates::new(&self.record, effects, &options.prior, true, &near_s);
        if self.restored {
            candidates = candidates.without_lost_ticks();
        }
        if let Some(promising) = &self.promising {
            candidates = candidates.only(|g| {
                let group = &candidates.groups[g];
                group.named || promising.contains(&group.id)
            });
        }
        let there = Compared::wide(&self.record, &self.noise, candidates.clone(), self.onward());
        // a step so long that the filter diverges is not taken
        let here = || Compared::wide(&self.record, &self.noise, candidates, self.compared.theta.clone());
        self.compared = if there.has_diverged() { here() } else { there };
        self.look_at_promising();
    }

    /// In a large gap retains the most promising free forms, after all sets were compared.
    pub(crate) fn look_at_promising(&mut self) {
        if self.compared.gap() > LARGE {
            let found = self.compared.promising(PROMISING);
            // retained forms stay so
            self.promising = Some(match self.promising.take() {
                Some(before) if before.len() < 2 * PROMISING => before.into_iter().chain(found).collect(),
                Some(before) => before,
                None => found,
            });
        }
    }

    /// After all sets were compared: moves to the coordinates of the best one and compares again, until that settles;
    /// then removes outliers and estimates noise levels, and compares once more.
    pub(crate) fn settle(&mut self, effects: &[&'static dyn Driving], options: &Options) {
        self.converge(effects, options);
        // noise is estimated from the residuals of a settled model
        if self.clean(effects, options) {
            self.widen(effects, options, self.compared.steps_s());
            self.converge(effects, options);
        }
        self.leave_out();
        self.tell_levels();
    }

    pub(crate) fn converge(&mut self, effects: &[&'static dyn Driving], options: &Options) {
        let mut near = false;
        for _ in 1..WIDE {
            let stepped = self.compared.steps_s();
            let any = stepped.iter().any(Option::is_some);
            let settled = self.compared.next().1;
            if settled && (!any || near) {
                return;
            }
            let settled = Compared::narrow(&self.record, &self.noise, self.compared.plausible(), self.onward(), None);
            if settled.has_diverged() {
                return;
            }
            self.compared = settled;
            near = any;
            self.widen(effects, options, stepped);
        }
    }

    /// θ to continue from: that of the best set; in a large gap, where that is far off, the present one, so that steps
    /// are judged by their actual gain.
    fn onward(&self) -> Theta {
        let (next, settled) = self.compared.next();
        if settled || self.compared.gap() < LARGE { next } else { self.compared.theta.clone() }
    }
}

/// Settles the best set of `compared`.
pub(crate) fn settled(
    record: &Record,
    noise: Noise,
    compared: Compared,
    onsets_s: Onsets,
    effects: &[&'static dyn Driving],
    options: &Options,
) -> PreprocessingHypothesis {
    let settle = |noise: Noise, compared: Compared, onsets_s: Onsets| {
        let mut branch = PreprocessingHypothesis::new(record.clone(), noise, compared, onsets_s);
        branch.look_at_promising();
        branch.settle(effects, options);
        branch
    };
    let branch = settle(noise, compared, onsets_s);
    // noise that an effect passes on was taken for outliers and noise levels where the effect was found after them
    let Some(noise) = branch.shaken_from(record, &noise) else { return branch };
    let (candidates, theta) = (branch.compared.candidates.clone(), branch.compared.theta.clone());
    let compared = Compared::wide(record, &noise, candidates, theta);
    let other = settle(noise, compared, branch.onsets_s.clone());
    if other.top() > branch.top() { other } else { branch }
}
