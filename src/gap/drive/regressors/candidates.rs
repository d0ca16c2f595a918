//! Candidates for what a drive's model lacks: effects of the library and free forms, as groups of columns.

use super::basis::{CONSTANT, COSINES, Column, Equation, Follows, Scoped, nuisances, variations};
use super::structural_identifiability::{self, UNSEEN};
use crate::effects::drive::{Coordinate, DriveExplanation, Driving, ModelChange, Needs};
use crate::effects::{InDrives, in_drives};
use crate::gap::drive::fit::evidence::{Group, Nuisance, Rank};
use crate::gap::drive::record::Record;
use crate::gap::selection::prior::Prior;
use crate::model::drive::Instrument;

/// Nodes of the prior scale of a coordinate.
const NODES: usize = 6;
/// Prior scale of what bends a law where it is straight, as a share of that where it bends.
const STRAIGHT: f64 = 0.01;
/// Lower limit of the prior scale, as a share of an effect's smallest plausible size.
const LEAST: f64 = 1e-3;
/// Prior scales of free forms: root of the whitened column's energy over the whole drive.
const FREE_SIZES: [f64; 5] = [3.0, 10.0, 30.0, 100.0, 300.0];
/// Intervals of the grid of times at which the gyro's bias may jump.
const STEPS: usize = 24;
/// Ratio of the distances of successive times from the proposed time of a jump.
const CLOSER: f64 = 4.0;
/// Time constants with which a bias may settle after a jump, s.
const SETTLING_S: [f64; 3] = [0.4, 1.6, 6.4];

/// Prefix of the id of a coordinate that varies; the id of its effect follows.
pub(crate) const VARYING: &str = "free.varying.";

/// Kind of a group.
#[derive(Clone, Copy)]
pub(crate) enum Kind {
    /// Change of the model, by its index.
    Change(usize),
    /// Jump of the bias in this drive (index), at this time, s since it began.
    Step(usize, f64),
    /// Random walk of the bias.
    Walk,
    /// Variation of the first coordinate of this change (index).
    Varying(usize),
    /// A function of a covariate in an equation.
    Free(Equation, Follows),
}

/// All candidates in one drive.
#[derive(Clone)]
pub(crate) struct Candidates {
    /// Model changes, with their effects.
    pub changes: Vec<(&'static dyn Driving, &'static dyn ModelChange)>,
    /// Coordinates of each change, with plausible sizes for this robot.
    pub sizes: Vec<Vec<Coordinate>>,
    /// Columns of the pass.
    pub columns: Vec<Scoped>,
    /// Nuisance columns, which are in every set.
    pub nuisance: Vec<Nuisance>,
    /// Kind of each group.
    pub kinds: Vec<Kind>,
    /// The groups; those of free forms have no nodes until the Gram matrix is known.
    pub groups: Vec<Group>,
}

fn can(needs: Needs, record: &Record) -> bool {
    let [torques, gyro, pose] = [record.torques_n_m.is_some(), record.gyro_rad_s.is_some(), record.pose.is_some()];
    (!needs.torques || torques)
        && (!needs.gyro || gyro)
        && (!needs.pose || pose)
        && (!needs.length || torques || gyro || pose)
}

/// Whether the log has the channels that tell the effect.
#[must_use]
pub(crate) fn knowable(effect: &dyn Driving, record: &Record) -> bool {
    match effect.explanation() {
        DriveExplanation::Model(change) => {
            can(change.needs(), record)
                // without torques nothing but another sensor tells when the wheels turned
                && (change.lags() != Some(Instrument::Wheels) || record.torques_n_m.is_some() || record.gyro_rad_s.is_some())
                // a delay of the pose that the configuration leaves open is no effect
                && !(change.touches().pose && record.belief.pose_delay_std_s > 0.0)
        }
        DriveExplanation::GyroStep => record.gyro_rad_s.is_some(),
        DriveExplanation::MissedTicks(_) | DriveExplanation::WheelLattice => true,
        DriveExplanation::NoiseLevel(Instrument::Pose) => record.pose.is_some(),
        // without torques the accelerations are too roughly known
        DriveExplanation::NoiseLevel(of) => {
            record.torques_n_m.is_some() && (of == Instrument::Wheels || record.gyro_rad_s.is_some())
        }
    }
}

/// Whether free forms of `equation` lack the constant: that of the sideways speed always, and without torques those of
/// speed and turning over ground, which would take the place of a radius in a robot that drives evenly.
#[must_use]
pub(crate) fn no_constant(record: &Record, equation: Equation) -> bool {
    let speed = matches!(equation, Equation::Along | Equation::Turn);
    equation == Equation::Sideways || record.torques_n_m.is_none() && speed
}

impl Candidates {
    /// Those of `effects` that this drive can show, and, if `free`, the free forms. `near_s`: proposed time of a jump
    /// of the bias in each drive, s since that drive began.
    #[must_use]
    pub(crate) fn new(
        record: &Record,
        effects: &[&'static dyn Driving],
        prior: &Prior,
        free: bool,
        near_s: &[Option<f64>],
    ) -> Self {
        let mut all = Self {
            changes: Vec::new(),
            sizes: Vec::new(),
            columns: Vec::new(),
            nuisance: Vec::new(),
            kinds: Vec::new(),
            groups: Vec::new(),
        };
        for (column, std) in nuisances(record) {
            all.nuisance.push(Nuisance::new(all.columns.len(), std));
            all.columns.push(column);
        }
        for effect in effects.iter().filter(|e| knowable(**e, record)) {
            match effect.explanation() {
                DriveExplanation::Model(change) => match change.forms() {
                    [] => all.change(record, *effect, change, prior.ln_named),
                    forms => {
                        let ln_prior = prior.ln_named - (forms.len() as f64).ln();
                        forms.iter().for_each(|form| all.change(record, *effect, *form, ln_prior));
                    }
                },
                DriveExplanation::GyroStep => all.steps(record, effect.about().id, prior, near_s),
                // otherwise it equals an error of its wheel's radius, which is compared
                DriveExplanation::MissedTicks(loss)
                    if !structural_identifiability::is_lost_by_radius(record, effects) =>
                {
                    let sides = loss.mean();
                    let ln_prior = prior.ln_named + (UNSEEN / sides.len() as f64).ln();
                    sides.iter().for_each(|side| all.change(record, *effect, *side, ln_prior));
                }
                DriveExplanation::MissedTicks(_) | DriveExplanation::WheelLattice | DriveExplanation::NoiseLevel(_) => {
                }
            }
        }
        if record.gyro_rad_s.is_some() {
            all.walk(record, prior);
        }
        if free {
            all.free(record, prior);
            all.varying(record, prior);
        }
        all
    }

    fn push(&mut self, kind: Kind, id: &str, named: bool, columns: Vec<Scoped>, nodes: Vec<Vec<f64>>, ln_prior: f64) {
        let first = self.columns.len();
        let places = (first..first + columns.len()).collect();
        self.columns.extend(columns);
        let positive = if let Kind::Change(i) = kind { self.changes[i].1.positive() } else { 0 };
        let rank = match kind {
            Kind::Walk => Rank::Process,
            Kind::Free(Equation::Gyro, Follows::Time) => Rank::Path,
            _ if named => Rank::Law,
            _ => Rank::Form,
        };
        let drive = if let Kind::Step(drive, _) = kind { drive } else { 0 };
        self.kinds.push(kind);
        let id = id.to_owned();
        self.groups.push(Group { id, drive, named, columns: places, nodes, ln_prior, rank, positive, varies: None });
    }

    fn change(
        &mut self,
        record: &Record,
        effect: &'static dyn Driving,
        change: &'static dyn ModelChange,
        ln_prior: f64,
    ) {
        let place = self.changes.len();
        let sizes = structural_identifiability::sizes(record, effect.about().id, change);
        self.changes.push((effect, change));
        let std = change.usual_std(record.step_s);
        if std > 0.0 && record.torques_n_m.is_some() {
            self.nuisance.push(Nuisance { column: self.columns.len(), std, usual: Some(effect.about().id) });
            self.columns.push(Column::Usual(place).into());
        }
        let columns = (0..sizes.len()).map(|j| Column::Coordinate(place, j).into()).collect();
        self.push(Kind::Change(place), effect.about().id, true, columns, nodes(&sizes, change.unbent(), 1.0), ln_prior);
        self.sizes.push(sizes);
    }

    /// Jumps at times spread over each drive, and closer and closer around the one in `near_s`, down to one row: a jump
    /// of many standard deviations is worth knowing to the row. There the bias may also settle with time constants.
    /// Each time stands for those nearest to it, all equally probable.
    fn steps(&mut self, record: &Record, id: &str, prior: &Prior, near_s: &[Option<f64>]) {
        let total = record.span_s();
        for (drive, span) in record.spans_s().into_iter().enumerate() {
            let inside = |t: f64| t > record.step_s && t < span - record.step_s;
            let mut times: Vec<(f64, bool)> = (1..STEPS).map(|i| (span * i as f64 / STEPS as f64, false)).collect();
            if let Some(near) = near_s.get(drive).copied().flatten() {
                times.push((near, true));
                let mut away = record.step_s.max(1e-9 * span);
                while away < span / STEPS as f64 {
                    times.extend([(near - away, true), (near + away, true)]);
                    away *= CLOSER;
                }
            }
            times.retain(|t| inside(t.0));
            times.sort_by(|a, b| a.0.total_cmp(&b.0));
            let sigma = record.belief.gyro_std_rad_s;
            let nodes = |columns: usize| [0.03, 0.1, 0.3, 1.0, 3.0].iter().map(|s| vec![s * sigma; columns]).collect();
            for (i, &(t, near)) in times.iter().enumerate() {
                let from = if i == 0 { 0.0 } else { 0.5 * (times[i - 1].0 + t) };
                let to = times.get(i + 1).map_or(span, |next| 0.5 * (t + next.0));
                let sharp = if near { 0.5f64.ln() } else { 0.0 };
                let ln_prior = prior.ln_named + ((to - from) / total).max(f64::MIN_POSITIVE).ln() + sharp;
                let kind = Kind::Step(drive, t);
                let step = Column::GyroStep(t).of_drive(drive);
                self.push(kind, id, true, vec![step], nodes(1), ln_prior);
                if near {
                    let mut columns = vec![step];
                    columns.extend(SETTLING_S.map(|s| Column::GyroSettling(t, s).of_drive(drive)));
                    let nodes = nodes(columns.len());
                    self.push(kind, id, true, columns, nodes, ln_prior);
                }
            }
        }
    }

    /// A random walk of size K√T over the longest drive, a path of its own in each: coefficients K√(2T)/(nπ) of
    /// cos(nπu).
    fn walk(&mut self, record: &Record, prior: &Prior) {
        let Some(walk) = in_drives(InDrives::Walk) else { return };
        let sigma = record.belief.gyro_std_rad_s;
        let spans = record.spans_s();
        let longest = spans.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let every = || spans.iter().enumerate().flat_map(|(d, span)| (1..COSINES).map(move |n| (d, n, *span)));
        let node = |size: &f64| {
            let std = |n: usize| size * sigma * std::f64::consts::SQRT_2 / (n as f64 * std::f64::consts::PI);
            every().map(|(_, n, span)| std(n) * (span / longest).sqrt()).collect()
        };
        let nodes = [0.03, 0.1, 0.3, 1.0, 3.0].iter().map(node).collect();
        let columns = every().map(|(d, n, _)| Column::GyroCosine(n).of_drive(d)).collect();
        self.push(Kind::Walk, walk.id, true, columns, nodes, prior.ln_known_at_rest());
    }

    fn free(&mut self, record: &Record, prior: &Prior) {
        use Equation::{
            Along, Force, Gyro, Moment, PoseAcross, PoseAlong, PoseHeading, Sideways, Turn, WheelLeft, WheelRight,
        };
        let mut equations = vec![WheelLeft, WheelRight];
        if record.torques_n_m.is_some() {
            equations.extend([Force, Moment]);
        }
        if record.gyro_rad_s.is_some() {
            equations.push(Gyro);
        }
        if record.pose.is_some() {
            equations.extend([Sideways, Along, Turn, PoseAlong, PoseAcross, PoseHeading]);
        }
        for equation in equations {
            for follows in Follows::ALL {
                let torque = matches!(follows, Follows::Torque | Follows::TorqueRate);
                // without torques accelerations come from the same speeds that they would correct
                let forced = torque || matches!(follows, Follows::Acceleration | Follows::YawAcceleration);
                let known = !forced || record.torques_n_m.is_some();
                let sensible = match equation {
                    Force | Moment => !matches!(follows, Follows::Acceleration | Follows::YawAcceleration),
                    // with wheels and gyro alone, common changes of both wheels are motion, and opposite ones equal the
                    // gyro's form; only a pattern over one wheel's angle is neither
                    WheelLeft | WheelRight => !record.is_blind() || follows == Follows::WheelAngle,
                    Gyro => !torque,
                    // speeds then come from wheels and gyro: a pose that contradicts all of these alike tells how they
                    // read, and beside such a form no reading would tell the scale of the speeds
                    Turn if record.torques_n_m.is_none() => {
                        !torque && !matches!(follows, Follows::WheelAngle | Follows::YawRate | Follows::Turning)
                    }
                    Along if record.torques_n_m.is_none() => {
                        !torque && !matches!(follows, Follows::WheelAngle | Follows::Speed | Follows::Turning)
                    }
                    _ => !torque && follows != Follows::WheelAngle,
                };
                if !known || !sensible {
                    continue;
                }
                let skip = usize::from(follows == Follows::Time && no_constant(record, equation));
                let one = move |i: usize| Column::Free(equation, follows.first() + i);
                let functions = skip..follows.count();
                let columns = match follows {
                    // time begins anew in each drive
                    Follows::Time => (0..record.starts.len())
                        .flat_map(|d| functions.clone().map(move |i| one(i).of_drive(d)))
                        .collect(),
                    _ => functions.map(|i| one(i).into()).collect(),
                };
                let id = format!("free.{}.{}", short(equation), follows.id());
                self.push(Kind::Free(equation, follows), &id, false, columns, Vec::new(), prior.ln_free);
            }
        }
    }

    /// Variation of a change's first coordinate (a load that falls off, a gain that sags, a radius that grows), and
    /// departures from its law. A constant coefficient sets an effect of the library apart from what only resembles it
    /// (Nyblom 1989). An effect whose law has a form of its own may bend with speed and acceleration, and varies with
    /// time alone. Of several drives each may vary with time in its own way, and have another coefficient than the
    /// first.
    fn varying(&mut self, record: &Record, prior: &Prior) {
        for g in 0..self.groups.len() {
            let Kind::Change(i) = self.kinds[g] else { continue };
            // a loss that varies is what bursts are
            if self.changes[i].0.tick_loss().is_some() {
                continue;
            }
            // without torques a lag between wheels and gyro is told by their own past, as would be any function of its changes
            let lags = self.changes[i].1.lags();
            if record.torques_n_m.is_none() && matches!(lags, Some(Instrument::Gyro | Instrument::Wheels)) {
                continue;
            }
            let with = match self.changes[i].1.is_rigid() {
                true if record.torques_n_m.is_some() => 4,
                true => 3,
                false => 2,
            };
            let of = self.groups[g].columns[0];
            let change = self.changes[i].1;
            let own = change.coordinates().len();
            let departures = own..own + change.departures().len();
            let varying = |f: usize| Column::Varying(i, 0, f);
            let drives = record.starts.len();
            let mut columns: Vec<Scoped> = Vec::new();
            for f in &variations()[..with] {
                if *f > CONSTANT {
                    columns.extend((0..drives).map(|d| varying(*f).of_drive(d)));
                } else {
                    columns.push(varying(*f).into());
                }
            }
            columns.extend((1..drives).map(|d| varying(CONSTANT).of_drive(d)));
            columns.extend(departures.map(|j| Scoped::from(Column::Coordinate(i, j))));
            let id = format!("{VARYING}{}", self.groups[g].id);
            self.push(Kind::Varying(i), &id, false, columns, Vec::new(), prior.ln_free);
            if let Some(group) = self.groups.last_mut() {
                group.varies = Some(of);
            }
        }
    }

    /// Only the groups for which `keep` holds, with their columns and the nuisances.
    #[must_use]
    pub(crate) fn only(&self, keep: impl Fn(usize) -> bool) -> Self {
        let mut out = Self {
            changes: self.changes.clone(),
            sizes: self.sizes.clone(),
            columns: Vec::new(),
            nuisance: Vec::new(),
            kinds: Vec::new(),
            groups: Vec::new(),
        };
        for one in &self.nuisance {
            out.nuisance.push(Nuisance { column: out.columns.len(), ..one.clone() });
            out.columns.push(self.columns[one.column]);
        }
        for (g, group) in self.groups.iter().enumerate().filter(|(g, _)| keep(*g)) {
            let first = out.columns.len();
            out.columns.extend(group.columns.iter().map(|c| self.columns[*c]));
            out.kinds.push(self.kinds[g]);
            out.groups.push(Group { columns: (first..out.columns.len()).collect(), ..group.clone() });
        }
        for group in &mut out.groups {
            let Some(Column::Varying(i, j, _)) = group.columns.first().map(|c| out.columns[*c].column) else {
                continue;
            };
            group.varies = out.columns.iter().position(|c| c.column == Column::Coordinate(i, j));
        }
        out
    }

    /// Without the mean losses of ticks.
    #[must_use]
    pub(crate) fn without_lost_ticks(&self) -> Self {
        self.only(|g| !matches!(self.kinds[g], Kind::Change(i) if self.changes[i].0.tick_loss().is_some()))
    }

    /// The groups with their prior scales; `square`: energy of a whitened column. Free forms: sizes of the whitened
    /// column over the whole drive; columns without energy are dropped. Effects: from the least size that this drive
    /// can show, where that is below the plausible ones, every order of magnitude equally probable. A small effect is
    /// then not penalised by a wide prior.
    #[must_use]
    pub(crate) fn scaled(&self, square: impl Fn(usize) -> f64) -> Vec<Group> {
        let mut groups = self.groups.clone();
        for (group, kind) in groups.iter_mut().zip(&self.kinds) {
            let (Kind::Change(i), Some(first)) = (kind, group.columns.first()) else { continue };
            let coordinates = &self.sizes[*i];
            let least = FREE_SIZES[0] / (square(*first).sqrt() * coordinates[0].scale[0]);
            if least < 1.0 {
                group.nodes = nodes(coordinates, self.changes[*i].1.unbent(), least.max(LEAST));
            }
        }
        for group in groups.iter_mut().filter(|g| !g.named) {
            group.columns.retain(|c| square(*c) > 1e-18);
            let unit: Vec<f64> = group.columns.iter().map(|c| 1.0 / square(*c).sqrt()).collect();
            group.nodes = FREE_SIZES.iter().map(|s| unit.iter().map(|u| s * u).collect()).collect();
        }
        groups
    }
}

/// Prior scales of an effect's coordinates, which grow together from `least` times the smallest plausible size to the
/// largest. Half of the robots follow the law, the first `unbent` coordinates, and half bend it: a straight law does not
/// pay for all ways of bending it. The widest scales are the last.
fn nodes(coordinates: &[Coordinate], unbent: usize, least: f64) -> Vec<Vec<f64>> {
    let node = |i: usize, bend: f64| {
        let u = i as f64 / (NODES - 1) as f64;
        let scale = |(j, c): (usize, &Coordinate)| {
            let scale = (c.scale[0] * least).powf(1.0 - u) * c.scale[1].powf(u);
            if j < unbent { scale } else { bend * scale }
        };
        coordinates.iter().enumerate().map(scale).collect()
    };
    let follows = if unbent < coordinates.len() { Some(STRAIGHT) } else { None };
    follows.into_iter().chain([1.0]).flat_map(|bend| (0..NODES).map(move |i| node(i, bend))).collect()
}

fn short(equation: Equation) -> &'static str {
    match equation {
        Equation::Force => "force",
        Equation::Moment => "moment",
        Equation::Sideways => "sideways",
        Equation::Along => "along",
        Equation::Turn => "turn",
        Equation::WheelLeft => "wheel_left",
        Equation::WheelRight => "wheel_right",
        Equation::Gyro => "gyro",
        Equation::PoseAlong => "pose_along",
        Equation::PoseAcross => "pose_across",
        Equation::PoseHeading => "pose_heading",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::drive::{ids, registry};
    use crate::gap::drive::preprocess::acceleration_model::tests::{belief, recorded};

    fn candidates() -> Candidates {
        let record = recorded(belief(), 0.02, [vec![5.0; 400], vec![5.0; 400]], vec![0.0; 400]);
        Candidates::new(&record, registry(), &Prior::of_drives(), false, &[])
    }

    #[test]
    fn the_prior_of_an_effect_begins_at_what_the_drive_can_show() {
        let all = candidates();
        let at = all.groups.iter().position(|g| g.id == ids::scale_factor()).unwrap();
        let scales = |shown: f64| {
            let nodes = &all.scaled(|_| (FREE_SIZES[0] / shown).powi(2))[at].nodes;
            assert!(nodes.len() == NODES && nodes.windows(2).all(|n| n[0][0] < n[1][0]));
            [nodes[0][0], nodes[NODES - 1][0]]
        };
        let near = |a: [f64; 2], b: [f64; 2]| a.iter().zip(&b).all(|(a, b)| (a / b - 1.0).abs() < 1e-9);
        // a gain stands for a wider track here, which may be twice the nominal
        let widest = 0.5;
        // a drive that hardly shows a hundredth keeps the prior of most robots, which begins at 0.001
        assert!(near(scales(0.01), [1e-3, widest]));
        assert!(near(scales(2e-5), [2e-5, widest]));
        // a law that may bend has as many scales at which it is straight, first
        let bent = nodes(&[Coordinate { scale: [0.1, 1.0], bounds: [-9.0, 9.0] }; 2], 1, 1.0);
        assert!(bent.len() == 2 * NODES && bent[0][0] == bent[NODES][0] && bent[0][1] == STRAIGHT * bent[NODES][1]);
        // no prior reaches below the limit
        assert!(near(scales(1e-12), [1e-3 * LEAST, widest]));
    }
}
