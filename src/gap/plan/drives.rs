//! E = ln p(z | truth) - ln p(z | rival) at the readings that the truth predicts on average, of the log and an experiment together
//!
//! The model of the truth is linearised at the sizes that were simulated, with the columns of every rival, as the diagnosis does
//! that says which effects are alike. Effects of several forms have the sizes that are fitted to both simulated drives. Chance in
//! the readings plays no part. What is the same to every reading of both drives is worth nothing.

use super::rivals::Rival;
use super::worth::Pair;
use crate::config::Config;
use crate::effects::Library;
use crate::effects::drive::{Driving, late};
use crate::error::Result;
use crate::gap::diagnosis::Drive;
use crate::gap::drive::fit::Compared;
use crate::gap::drive::options::Options as DriveOptions;
use crate::gap::drive::preprocess::changepoint;
use crate::gap::drive::preprocess::initial_noise::{InitialNoise, diffused};
use crate::gap::drive::record::Record;
use crate::gap::drive::regressors::candidates::Candidates;
use crate::gap::drive::regressors::practical_identifiability::{LN_ODDS, TORQUES, gains, lacking};
use crate::gap::drive::regressors::structural_identifiability::StructuralClasses;
use crate::gap::power::simulated::Simulator;
use crate::gap::selection::search::Member;
use crate::model::drive::Instrument;
use crate::signal::Log;
use crate::simulate::Seeds;

/// Evidence from which on a diagnosis of drives tells two effects apart, nats.
pub(super) fn resolution() -> f64 {
    // of the expected evidence, and of the posterior, for which evidence counts 1/T
    LN_ODDS * DriveOptions::default().calibration.temperature.max(1.0)
}

/// Drives that are simulated with each rival as the truth.
pub(super) struct Drives<'a> {
    config: &'a Config,
    library: &'a Library,
    rivals: Vec<Rival>,
    /// Ids of rivals that the recorded drive does not show.
    hidden: Vec<String>,
    seeds: Seeds,
    since_power_on_s: f64,
    /// The recorded drive as each rival would have made it.
    recorded: Vec<Log>,
}

impl<'a> Drives<'a> {
    /// Of the drive `log` with each of `rivals`; nothing in it would show those that are `hidden`.
    ///
    /// # Errors
    /// Those of the simulation.
    pub(super) fn new(
        config: &'a Config,
        log: &Log,
        library: &'a Library,
        (rivals, hidden): (&[Rival], Vec<String>),
        (seed, since_power_on_s): (u64, f64),
    ) -> Result<Self> {
        let seeds = Seeds::from(seed);
        let all: Vec<&'static dyn Driving> = library.driving().collect();
        let rivals: Vec<Rival> = rivals.iter().map(|r| within_rows(r, &all, log.time.median_step_s())).collect();
        let simulator = Simulator::new(config, log, library, since_power_on_s);
        let recorded = rivals.iter().map(|r| simulator.log(&r.tables(), seeds)).collect::<Result<_>>()?;
        Ok(Self { config, library, rivals, hidden, seeds, since_power_on_s, recorded })
    }

    /// Channels that the log lacks, in words, but torques where they were `tried`.
    ///
    /// # Errors
    /// Those of [`Record::new`].
    pub(super) fn lacking(&self, tried: bool) -> Result<Vec<&'static str>> {
        let first =
            self.recorded.first().map(|log| Record::new(self.config, log, self.since_power_on_s)).transpose()?;
        let mut channels = first.as_ref().map_or_else(Vec::new, lacking);
        channels.retain(|channel| !(tried && *channel == TORQUES));
        Ok(channels)
    }

    /// Every truth against every rival, after a drive with these `inputs` and a known load, kg, and the largest evidence of a truth over no
    /// effect, nats; `alone`: the drive has channels that the log lacks, and is diagnosed by itself.
    ///
    /// # Errors
    /// Those of the simulation, and of [`Record::of_drives`].
    pub(super) fn pairs(&self, inputs: &Log, load_kg: f64, alone: bool) -> Result<(Vec<Pair>, f64)> {
        let loaded = self.config.carrying(load_kg);
        let simulator = Simulator::new(&loaded, inputs, self.library, self.since_power_on_s);
        let seeds = Seeds {
            motion: self.seeds.motion.wrapping_add(1),
            sensors: self.seeds.sensors.wrapping_add(1),
            ..self.seeds
        };
        let (mut pairs, mut shown) = (Vec::new(), 0.0f64);
        for (truth, recorded) in self.rivals.iter().zip(&self.recorded) {
            let new = simulator.log(&truth.tables(), seeds)?;
            let [recorded, new] = [recorded, &new].map(|log| Drive::new(log, self.since_power_on_s));
            let both = [recorded, new.carrying(load_kg)];
            let record = Record::of_drives(self.config, if alone { &both[1..] } else { &both })?;
            let (own, over) = self.over(truth, &record, alone);
            shown = shown.max(own);
            pairs.extend(over.into_iter().map(|(rival, nats)| Pair::new(&truth.id, rival, nats, resolution())));
        }
        Ok((pairs, shown))
    }

    /// Expected evidence of `truth` in a `record` of it over no effect, and over each other rival, nats. A record that is judged `alone`
    /// is not known to exclude the effects that the log excludes: those that resemble the truth in it are rivals too, and so are those
    /// that the log does not show.
    fn over(&self, truth: &Rival, record: &Record, alone: bool) -> (f64, Vec<(&str, f64)>) {
        let hidden = self.hidden.iter().filter(|_| alone);
        let known = self.rivals.iter().map(|r| &r.id).chain(hidden).map(String::as_str);
        let others = known.filter(|id| *id != truth.id);
        // the sizes of motions, known roughly, tell no laws apart that are one and the same to the readings
        let every: Vec<&'static dyn Driving> = self.library.driving().collect();
        let classes = StructuralClasses::of(record, &every);
        if others.clone().all(|id| classes.are_same(&truth.id, id)) {
            return (f64::INFINITY, others.map(|id| (id, 0.0)).collect());
        }
        let options = DriveOptions::default();
        let asked = |id: &str| alone || self.rivals.iter().any(|r| r.has(id));
        let effects: Vec<&'static dyn Driving> = self.library.driving().filter(|e| asked(e.about().id)).collect();
        let all = Candidates::new(record, &effects, &options.prior, false, &changepoint::of_each(record));
        let (noise, _) = diffused(record, InitialNoise::of(record).noise, &all);
        let own: Vec<usize> = (0..all.groups.len()).filter(|g| truth.has(&all.groups[*g].id)).collect();
        let simulated = self.sizes(truth, &all);
        let fitted = Compared::all_in(record, &noise, all.only(|g| own.contains(&g)), simulated.clone());
        // a size that this record does not determine is where chance leads it: of a robot that stands a delay of many rows
        let mut theta = fitted.next().0;
        theta.iter_mut().zip(simulated).filter(|(_, s)| s.iter().any(|v| *v != 0.0)).for_each(|(t, s)| *t = s);
        let problem = all.linearise(record, &noise, &theta);
        let members: Vec<Member> = fitted.sets[0].fitted.iter().map(|&(g, node)| (own[g], node)).collect();
        let rest: Vec<Member> = members.iter().copied().filter(|m| all.groups[m.0].id != truth.id).collect();
        let gains = gains(&problem.expected(&members), &all.groups, &rest);
        // what has no columns, or explains less than nothing, is no better than nothing
        let gain = |id: &str| gains.iter().find(|g| all.groups[g.0.0].id == id).map_or(0.0, |g| g.1.max(0.0));
        // one that this record does not show either may be the truth
        let is_open = |id: &str| self.hidden.iter().any(|h| h == id) && all.groups.iter().all(|g| g.id != id);
        let over = |id| {
            if is_open(id) || classes.are_same(&truth.id, id) { 0.0 } else { gain(&truth.id) - gain(id) }
        };
        let own = gain(&truth.id);
        let is_known = |id: &str| self.rivals.iter().any(|r| r.has(id)) || self.hidden.iter().any(|h| h == id);
        let is_new = |id: &&str| alone && own >= resolution() && !is_known(id);
        let new = effects.iter().map(|e| e.about().id).filter(is_new).map(|id| (id, over(id)));
        (own, others.map(|id| (id, over(id))).chain(new.filter(|(_, nats)| *nats < resolution())).collect())
    }

    /// Where the fit begins: at the sizes that were simulated, zero for effects that have several forms.
    fn sizes(&self, truth: &Rival, all: &Candidates) -> Vec<Vec<f64>> {
        let mut theta = all.zero();
        for table in truth.tables() {
            let mut of = all.changes.iter().enumerate().filter(|(_, c)| c.0.about().id == table.id);
            if let (Some((i, (_, change))), None) = (of.next(), of.next()) {
                let own = change.theta(&table.parameters);
                theta[i].iter_mut().zip(own).for_each(|(to, from)| *to = from);
            }
        }
        theta
    }
}

/// `rival`, with the instruments that are late beside it late by less than a row of `step_s`. A diagnosis moves readings by whole rows,
/// which are the same to every rival; a filter that holds delays of several rows amplifies its own errors.
fn within_rows(rival: &Rival, effects: &[&'static dyn Driving], step_s: f64) -> Rival {
    let mut rival = rival.clone();
    for late in [Instrument::Wheels, Instrument::Gyro].into_iter().filter_map(|of| late(effects, of)) {
        let delays =
            rival.beside.iter_mut().filter(|b| b.id == late.id).filter_map(|b| b.parameters.get_mut(late.size()));
        delays.for_each(|delay_s| *delay_s = delay_s.rem_euclid(step_s));
    }
    rival
}
