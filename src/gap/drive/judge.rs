//! Judges one drive: which sets of effects and free forms explain it, how probable each is, and what each closes.
//!
//! Order: lattice of the wheels, how speeds change where there are no torques, a start for what bends too much, the comparison of
//! sets, single outliers, noise levels; then the same with the lost ticks of one wheel put back, if that looks worth it.

use super::bursts::{self, Bursts, Sought};
use super::candidates::{Candidates, Kind, Prior, knowable};
use super::column::Equation;
use super::fit::{Compared, Theta, models};
use super::pass::{Channel, Innovation, Models, Noise, Unforced, run};
use super::record::Record;
use crate::effects::Parameters;
use crate::effects::drive::{DriveExplanation, Driving};
use crate::gap::Calibration;
use crate::gap::findings::{Findings, Part, WeightedSet};
use crate::gap::layers::lattice;
use crate::model::drive::DriveModel;

/// How drives are judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Prior odds.
    pub prior: Prior,
    /// How evidences become probabilities.
    pub calibration: Calibration,
}

impl Default for Options {
    fn default() -> Self {
        let prior = Prior::default();
        Self { prior, calibration: Calibration::of_drives(&prior.of_search()) }
    }
}

/// What was found in one drive, and what its simulator needs to know.
#[derive(Debug, Clone)]
pub struct Judged {
    /// Sets with their probabilities.
    pub findings: Findings,
    /// Noise that the nominal filter assumes, with how fast speeds diffuse where there are no torques.
    pub nominal_noise: Noise,
}

/// A wheel lattice finer than this share of the noise is how the file keeps its numbers.
const FINE: f64 = 0.01;
/// Innovations beyond this many standard deviations may be outliers.
const OUTLYING: f64 = 6.0;
/// Readings on either side that it is held against.
const NEIGHBOURS: usize = 5;
/// More of them than this share is no matter of single readings.
const MANY: f64 = 0.02;
/// ln odds that one reading is an outlier, and of its size.
const LN_OUTLIER: f64 = -9.0;
/// Evidence from which lost ticks are looked into, nats.
const WORTH: f64 = 8.0;
/// Accounts of lost ticks that are tried.
const TRIED: usize = 4;
/// Nats by which one may fall short before free forms have been tried beside it, and before its model has settled.
const SHORT: f64 = 50.0;
const HOPELESS: f64 = 500.0;
/// Comparisons of all sets at most.
const WIDE: usize = 3;
/// Sets that take part in the answer.
const SETS: usize = 60;

/// Judges `record` with `effects`.
#[must_use]
pub fn judge(record: &Record, effects: &[&'static dyn Driving], options: &Options) -> Judged {
    let lsb = [0, 1]
        .into_iter()
        .filter_map(|i| lattice::step(&record.wheels_rad_s[i]))
        .reduce(f64::min)
        .filter(|lsb| *lsb > FINE * record.belief.wheel_std_rad_s);
    let mut noise = Noise::believed(record, lsb);
    if record.torques_n_m.is_none() {
        noise.unforced = unforced(record, &noise);
    }
    let nominal_noise = Noise { unforced: noise.unforced, ..Noise::believed(record, None) };
    let all = Candidates::new(record, effects, &options.prior, true, None);
    let begin = start(record, &noise, &all);
    let compared = first(record, &noise, all, &begin);
    let mut branch = Branch::new(record.clone(), noise, compared);
    branch.settle(effects, options);
    // what the lattice closes: the same model with the nominal noise of the wheels beside it
    let lattice = lsb.map(|lsb| {
        let mut nominal = branch.noise;
        nominal.reading[0] = record.belief.wheel_std_rad_s.powi(2);
        nominal.reading[1] = nominal.reading[0];
        let here = branch.ln_likelihood(&branch.noise) - branch.ln_likelihood(&nominal);
        lattice_part(lsb, here.max(1.0), knows(effects, "encoder.quantization"))
    });
    let mut sets = branch.sets();
    if knows(effects, "encoder.missed_ticks")
        && let Some((other, bursts)) = restored(record, &branch, &begin, &noise, effects, options)
    {
        let lost = missed_part(&bursts, other.top() - branch.top());
        let with = other.sets().into_iter();
        sets.extend(with.map(|s| WeightedSet { parts: s.parts.into_iter().chain([lost.clone()]).collect(), ..s }));
    }
    for set in &mut sets {
        set.parts.extend(lattice.iter().cloned());
    }
    let findings = Findings::new(sets, &options.prior.of_search(), &options.calibration, record.notes.clone());
    Judged { findings, nominal_noise }
}

/// The drive with the lost ticks of one wheel put back, in the account that explains it best; none where none comes near
/// `as_is`.
fn restored(
    record: &Record,
    as_is: &Branch,
    begin: &Theta,
    noise: &Noise,
    effects: &[&'static dyn Driving],
    options: &Options,
) -> Option<(Branch, Bursts)> {
    let zero = as_is.compared.candidates.zero();
    let mut all: Vec<(Bursts, &Theta)> = Vec::new();
    for theta in [&zero, begin, &as_is.compared.theta] {
        let models = Branch::models_at(record, &as_is.compared.candidates, theta);
        for side in [0, 1] {
            let sought = Sought { side, loss: None, slow: true };
            let found = bursts::find(record, &models, &as_is.noise, sought).filter(|b| b.ln_evidence > WORTH);
            // the same account from another model leads to the same comparison
            all.extend(found.filter(|b| all.iter().all(|(other, _)| other != b)).map(|b| (b, theta)));
        }
    }
    all.sort_by(|a, b| b.0.ln_evidence.total_cmp(&a.0.ln_evidence));
    all.truncate(TRIED);
    let fresh = Noise { unforced: as_is.noise.unforced, ..*noise };
    let plausible = as_is.compared.plausible();
    let top = as_is.top();
    let settled = |bursts: Bursts, theta: &Theta| {
        let restored = bursts.restored(record);
        let own = bursts.ln_path + bursts.ln_jacobian() + options.prior.ln_named;
        let hopeless = top - own - HOPELESS;
        let compared = Compared::narrow(&restored, &fresh, plausible.clone(), theta.clone(), Some(hopeless));
        let mut other = Branch::new(restored, fresh, compared);
        other.extra_weight += own;
        if other.top() > top - HOPELESS {
            other.clean(options);
        }
        (other, bursts)
    };
    let better = |a: &(Branch, Bursts), b: &(Branch, Bursts)| a.0.top().total_cmp(&b.0.top());
    let best = all.into_iter().map(|(bursts, theta)| settled(bursts, theta)).max_by(better)?;
    // once more with the model as it is then, from which nothing slow has to be taken out
    let theta = best.0.compared.next().0;
    let models = Branch::models_at(record, &best.0.compared.candidates, &theta);
    let sought = Sought { side: best.1.side, loss: None, slow: false };
    let again = bursts::find(record, &models, &best.0.noise, sought).map(|bursts| settled(bursts, &theta));
    let best = again.into_iter().chain([best]).max_by(better);
    // among the plausible sets alone it may fall short by what free forms have gained
    let (mut other, bursts) = best.filter(|b| b.0.top() > top - SHORT)?;
    other.widen(effects, options, other.compared.step_s());
    other.settle(effects, options);
    (other.top() > top - SHORT).then_some((other, bursts))
}

fn knows(effects: &[&'static dyn Driving], id: &str) -> bool {
    effects.iter().any(|e| e.about().id == id)
}

/// All sets compared at `begin`; and where a free form is in the best one, also where the named effects settle without any.
///
/// Free forms are linear in the innovations of one pass. An effect that is strong bends these, and a free form takes what the
/// bend leaves: the effect has to be compared at its own coordinates.
fn first(record: &Record, noise: &Noise, all: Candidates, begin: &Theta) -> Compared {
    let compared = Compared::wide(record, noise, all.clone(), begin.clone());
    if compared.sets[0].members.iter().all(|m| all.groups[m.0].named) {
        return compared;
    }
    let named = all.only(|g| all.groups[g].named && !matches!(all.kinds[g], Kind::Step(_)));
    let (theta, _) = Compared::narrow(record, noise, named, begin.clone(), None).next();
    let there = Compared::wide(record, noise, all, theta);
    if there.top() > compared.top() { there } else { compared }
}

/// How speeds change, where no torque says how they move: the most likely.
fn unforced(record: &Record, noise: &Noise) -> Unforced {
    let models = Models { here: DriveModel::new(record.belief.robot, Vec::new()), beside: Vec::new() };
    let weigh = |unforced: Unforced| run(record, &models, &Noise { unforced, ..*noise }, &[], |_| {}).ln_likelihood();
    let mut here = Unforced { diffusion: [0.001, 0.002], lasting: 0.9 };
    let mut best = weigh(here);
    let mut factor = 8.0;
    while factor > 1.3 {
        let mut moved = false;
        for (v, w) in [(factor, 1.0), (1.0 / factor, 1.0), (1.0, factor), (1.0, 1.0 / factor)] {
            let next = Unforced { diffusion: [here.diffusion[0] * v, here.diffusion[1] * w], ..here };
            let weight = weigh(next);
            if weight > best && next.diffusion.iter().all(|q| (1e-9..1e4).contains(q)) {
                (best, here, moved) = (weight, next, true);
            }
        }
        if !moved {
            factor = f64::sqrt(factor);
        }
    }
    for lasting in [0.0, 0.5, 0.75, 0.95, 1.0] {
        let next = Unforced { lasting, ..here };
        let weight = weigh(next);
        if weight > best {
            (best, here) = (weight, next);
        }
    }
    here
}

/// One way of reading the drive: as it is, or with lost ticks put back.
struct Branch {
    record: Record,
    believed: Noise,
    noise: Noise,
    compared: Compared,
    /// Readings of gyro, pose and wheels
    put_aside: [usize; 3],
    extra_weight: f64,
    extra_parts: Vec<Part>,
}

impl Branch {
    fn new(record: Record, noise: Noise, compared: Compared) -> Self {
        Self { record, believed: noise, noise, compared, put_aside: [0; 3], extra_weight: 0.0, extra_parts: Vec::new() }
    }

    /// Puts outliers aside and takes noise levels from what is left; if there are any, settles again.
    fn clean(&mut self, options: &Options) -> bool {
        let changed = self.put_outliers_aside(options) | self.level(options);
        if changed {
            let (candidates, from) = (self.compared.plausible(), self.compared.next().0);
            self.compared = Compared::narrow(&self.record, &self.noise, candidates, from, None);
        }
        changed
    }

    /// Compares all sets where the best one lies.
    fn widen(&mut self, effects: &[&'static dyn Driving], options: &Options, near_s: Option<f64>) {
        let candidates = Candidates::new(&self.record, effects, &options.prior, true, near_s);
        let there = Compared::wide(&self.record, &self.noise, candidates.clone(), self.compared.next().0);
        // a step so long that the filter diverges is not taken
        let diverged = !there.sets[0].ln_weight.is_finite();
        let here = || Compared::wide(&self.record, &self.noise, candidates, self.compared.theta.clone());
        self.compared = if diverged { here() } else { there };
    }

    /// After all sets were compared: moves to the best one's coordinates and compares again, until that settles; then cleans,
    /// and once more.
    fn settle(&mut self, effects: &[&'static dyn Driving], options: &Options) {
        self.converge(effects, options);
        // noise is judged by what a settled model leaves
        if self.clean(options) {
            self.widen(effects, options, self.compared.step_s());
            self.converge(effects, options);
        }
    }

    fn converge(&mut self, effects: &[&'static dyn Driving], options: &Options) {
        let mut near = None;
        for _ in 1..WIDE {
            let stepped = self.compared.step_s();
            let (next, settled) = self.compared.next();
            if settled && (stepped.is_none() || near.is_some()) {
                return;
            }
            self.compared = Compared::narrow(&self.record, &self.noise, self.compared.plausible(), next, None);
            near = stepped;
            self.widen(effects, options, near);
        }
    }

    fn models_at(record: &Record, candidates: &Candidates, theta: &Theta) -> Models {
        models(record, &candidates.change_list(), theta, false)
    }

    fn ln_likelihood(&self, noise: &Noise) -> f64 {
        let models = Self::models_at(&self.record, &self.compared.candidates, &self.compared.theta);
        run(&self.record, &models, noise, &[], |_| {}).ln_likelihood()
    }

    fn top(&self) -> f64 {
        self.compared.top() + self.extra_weight
    }

    /// Innovations whitened under the best set, coefficients included.
    fn residuals(&self, mut each: impl FnMut(&Innovation, f64)) {
        let c = &self.compared;
        let members = &c.sets[0].members;
        let inside: Vec<usize> = members.iter().map(|m| m.0).collect();
        let few = c.candidates.only(|g| inside.contains(&g));
        let coefficients = c.problem.coefficients(members);
        // columns keep their order: nuisances first, then the members'
        let mut wide: Vec<usize> = c.candidates.nuisance.iter().map(|n| n.0).collect();
        wide.extend(
            c.candidates
                .groups
                .iter()
                .enumerate()
                .filter(|(g, _)| inside.contains(g))
                .flat_map(|(_, g)| g.columns.clone()),
        );
        let here: Vec<f64> = wide
            .iter()
            .zip(&few.columns)
            .map(|(column, kind)| {
                let total = coefficients.iter().find(|x| x.0 == *column).map_or(0.0, |x| x.1);
                match *kind {
                    super::column::Column::Coordinate(i, j) => total - c.theta[i][j],
                    _ => total,
                }
            })
            .collect();
        let models = models(&self.record, &few.change_list(), &c.theta, true);
        let _ = run(&self.record, &models, &self.noise, &few.columns, |i| {
            let explained: f64 = i.slopes.iter().zip(&here).map(|(s, b)| s * b).sum();
            each(i, i.white - explained);
        });
    }

    /// Single readings far off are put aside; returns whether there were any.
    fn put_outliers_aside(&mut self, options: &Options) -> bool {
        let mut found: Vec<(Channel, usize, f64)> = Vec::new();
        let mut counts = [0usize; 6];
        self.residuals(|i, white| {
            counts[i.channel as usize] += 1;
            if white.abs() > OUTLYING {
                found.push((i.channel, i.row, white));
            }
        });
        let mut any = false;
        for (place, (id, named, channels)) in [
            ("gyro.outliers", true, &Channel::ALL[2..3]),
            ("free.outliers.pose", false, &Channel::ALL[3..6]),
            ("free.outliers.wheels", false, &Channel::ALL[0..2]),
        ]
        .into_iter()
        .enumerate()
        {
            let own = |f: &&(Channel, usize, f64)| channels.contains(&f.0) && self.stands_out(f.0, f.1);
            let here: Vec<&(Channel, usize, f64)> = found.iter().filter(own).collect();
            let all: usize = channels.iter().map(|c| counts[*c as usize]).sum();
            let gain: f64 = here.iter().map(|f| 0.5 * f.2 * f.2 + LN_OUTLIER).sum();
            let prior = if named { options.prior.ln_rest } else { options.prior.ln_free };
            // neighbours that are off together are no single readings
            let rows: std::collections::BTreeSet<usize> = here.iter().map(|f| f.1).collect();
            let alone = rows.iter().filter(|r| !rows.contains(&(**r + 1))).count();
            if here.is_empty()
                || here.len() as f64 > MANY * all as f64
                || 3 * alone < 2 * rows.len()
                || gain + prior < 3.0
            {
                continue;
            }
            for (channel, row, _) in here {
                let column = match channel {
                    Channel::Gyro => self.record.gyro_rad_s.as_mut().map(|g| &mut g[*row]),
                    Channel::WheelLeft => Some(&mut self.record.wheels_rad_s[0][*row]),
                    Channel::WheelRight => Some(&mut self.record.wheels_rad_s[1][*row]),
                    Channel::X | Channel::Y | Channel::Heading => {
                        self.record.pose.as_mut().map(|p| &mut p[*channel as usize - 3][*row])
                    }
                };
                if let Some(value) = column {
                    *value = f64::NAN;
                }
            }
            let again = self.put_aside[place] > 0;
            self.put_aside[place] += rows.len();
            let count = self.put_aside[place];
            let share = count as f64 / all.max(1) as f64;
            let mut part = described(id, named, gain, format!("{count} single readings are far off"));
            if named {
                part.parameters = Parameters::from([("probability_per_sample".into(), share)]);
                part.std = Parameters::from([("probability_per_sample".into(), share / (count as f64).sqrt())]);
            }
            self.extra_weight += if again { gain } else { gain + prior };
            self.add(part);
            any = true;
        }
        any
    }

    /// Without torques a robot that starts to move looks like a reading far off, but then gyro and wheels agree: whether this
    /// reading departs from what the others make of the yaw rate, more than they do around it.
    fn stands_out(&self, channel: Channel, row: usize) -> bool {
        let r = &self.record;
        let (None, Some(gyro), true) = (&r.torques_n_m, &r.gyro_rad_s, channel <= Channel::Gyro) else { return true };
        let robot = &r.belief.robot;
        let apart = |k: usize| {
            let [left, right] = [0, 1].map(|i| robot.radius_m[i] * r.wheels_rad_s[i][k]);
            gyro[k] - 0.5 * (right - left) / robot.half_track_m
        };
        let around = row.saturating_sub(NEIGHBOURS)..(row + NEIGHBOURS + 1).min(r.len());
        let mut near: Vec<f64> = around.filter(|k| *k != row).map(apart).filter(|v| v.is_finite()).collect();
        near.sort_by(f64::total_cmp);
        let Some(middle) = near.get(near.len() / 2).copied() else { return true };
        let wheel = robot.radius_m[0] * self.noise.reading[0].sqrt() / robot.half_track_m;
        let std = (self.noise.reading[2] + 0.5 * wheel * wheel).sqrt();
        (apart(row) - middle).abs() > OUTLYING * std
    }

    /// Noise that is not as large as believed; returns whether there is any.
    fn level(&mut self, options: &Options) -> bool {
        let mut sums = [(0usize, 0.0); 6];
        self.residuals(|i, white| {
            let sum = &mut sums[i.channel as usize];
            *sum = (sum.0 + 1, sum.1 + white * white);
        });
        let mut any = false;
        for (name, channels) in
            [("wheel_left", 0..1), ("wheel_right", 1..2), ("gyro", 2..3), ("position", 3..5), ("heading", 5..6)]
        {
            let (n, square) = channels.clone().fold((0, 0.0), |s, c| (s.0 + sums[c].0, s.1 + sums[c].1));
            if n < 16 {
                continue;
            }
            let ratio = square / n as f64;
            let gain = 0.5 * n as f64 * (ratio - 1.0 - ratio.ln());
            if gain - 0.5 * (n as f64).ln() + options.prior.ln_free < 3.0 {
                continue;
            }
            if self.record.torques_n_m.is_none() && channels.start < 3 {
                // how the robot accelerates is no more than a diffusion here, and the sensors' noise takes what that lacks
                for c in channels {
                    self.noise.reading[c] *= ratio;
                }
                any = true;
                continue;
            }
            let id = format!("free.level.{name}");
            let again = self.extra_parts.iter().any(|p| p.id == id);
            let total = ratio * self.noise.reading[channels.start] / self.believed.reading[channels.start];
            for c in channels {
                self.noise.reading[c] *= ratio;
            }
            let text = format!("the noise of {name} is {:.2} times as large as believed", total.sqrt());
            let share = 0.5 * n as f64 * (total - 1.0 - total.ln());
            self.extra_parts.retain(|p| p.id != id);
            self.extra_parts.push(described(&id, false, share, text));
            if !again {
                // the better noise is in the evidence itself; what it costs is said here
                self.extra_weight += options.prior.ln_free - 0.5 * (n as f64).ln();
            }
            any = true;
        }
        any
    }

    /// One part an id.
    fn add(&mut self, mut part: Part) {
        if let Some(at) = self.extra_parts.iter().position(|p| p.id == part.id) {
            part.share += self.extra_parts.swap_remove(at).share;
        }
        self.extra_parts.push(part);
    }

    fn sets(&self) -> Vec<WeightedSet> {
        let c = &self.compared;
        let part = |members: &[super::evidence::Member]| -> Vec<Part> {
            let shares = c.problem.shares(members);
            let coefficients = c.problem.coefficients(members);
            members.iter().zip(shares).map(|(&(g, _), share)| self.part(g, share, &coefficients)).collect()
        };
        c.sets
            .iter()
            .take(SETS)
            .map(|w| WeightedSet {
                parts: part(&w.members).into_iter().chain(self.extra_parts.iter().cloned()).collect(),
                ln_weight: w.ln_weight + self.extra_weight,
                probability: 0.0,
            })
            .collect()
    }

    fn part(&self, group: usize, share: f64, coefficients: &super::evidence::Coefficients) -> Part {
        let candidates = &self.compared.candidates;
        let g = &candidates.groups[group];
        let value = |column: usize| coefficients.iter().find(|c| c.0 == column).map_or((0.0, 0.0), |c| (c.1, c.2));
        let mut part = Part::new(&g.id, g.named, share);
        match candidates.kinds[group] {
            Kind::Change(i) => {
                let change = candidates.changes[i].1;
                let theta: Vec<f64> = g.columns.iter().map(|c| value(*c).0).collect();
                part.parameters = change.parameters(&theta);
                // by the delta method, coordinates taken one by one
                for (j, column) in g.columns.iter().enumerate() {
                    let std = value(*column).1;
                    let mut beside = theta.clone();
                    beside[j] += 0.1 * std;
                    for (name, moved) in change.parameters(&beside) {
                        let slope = 10.0 * (moved - part.parameters.get(&name).copied().unwrap_or(0.0));
                        let total: &mut f64 = part.std.entry(name).or_insert(0.0);
                        *total = total.hypot(slope);
                    }
                }
            }
            Kind::Step(t) => {
                let (step, std) = value(g.columns[0]);
                part.parameters = Parameters::from([("step_rad_s".into(), step)]);
                part.std = Parameters::from([("step_rad_s".into(), std)]);
                let at = self.record.times_s[0] + t;
                part.time_s = Some([at, at]);
            }
            Kind::Walk => {
                // K from the sum of squares of its cosines: coefficient n is K √(2T)/(nπ)
                let span = self.record.span_s();
                let squares = g.columns.iter().enumerate().map(|(n, c)| {
                    let (mean, std) = value(*c);
                    let unit = std::f64::consts::SQRT_2 / ((n + 1) as f64 * std::f64::consts::PI);
                    (mean * mean + std * std) / (unit * unit * span)
                });
                let k = (squares.sum::<f64>() / g.columns.len() as f64).sqrt();
                let relative = (0.5 / g.columns.len() as f64).sqrt();
                part.parameters = Parameters::from([("rate_random_walk_rad_s_sqrt_s".into(), k)]);
                part.std = Parameters::from([("rate_random_walk_rad_s_sqrt_s".into(), k * relative)]);
            }
            Kind::Free(equation, follows) => {
                part.description =
                    format!("{}: something that follows {}", equation.words(), follows.id().replace('_', " "));
            }
        }
        part
    }
}

/// Where to begin: at zero, or where a change that bends much explains far more.
fn start(record: &Record, noise: &Noise, candidates: &Candidates) -> Theta {
    let zero = candidates.zero();
    let weigh = |theta: &Theta| {
        let models = Branch::models_at(record, candidates, theta);
        run(record, &models, noise, &[], |_| {}).ln_likelihood()
    };
    let mut best = (weigh(&zero) + 50.0, zero.clone());
    for (i, (_, change)) in candidates.changes.iter().enumerate() {
        for start in change.starts() {
            let mut theta = zero.clone();
            theta[i] = start;
            let weight = weigh(&theta);
            if weight > best.0 {
                best = (weight, theta);
            }
        }
    }
    best.1
}

fn described(id: &str, named: bool, share: f64, description: String) -> Part {
    Part { description, ..Part::new(id, named, share) }
}

fn lattice_part(lsb: f64, share: f64, named: bool) -> Part {
    let id = if named { "encoder.quantization" } else { "free.lattice.wheels" };
    let mut part = described(id, named, share, format!("wheel speeds lie on a lattice of {lsb:.5} rad/s"));
    if named {
        part.parameters = Parameters::from([("lsb_rad_s".into(), lsb)]);
        part.std = Parameters::from([("lsb_rad_s".into(), 1e-6 * lsb)]);
    }
    part
}

fn missed_part(bursts: &Bursts, share: f64) -> Part {
    use crate::effects::drive::missed_ticks::{BURST, LOSS, SHARE, SIDE};
    let side = if bursts.side == 0 { "left" } else { "right" };
    let mut part = described("encoder.missed_ticks", true, share, format!("the {side} wheel reads low in bursts"));
    part.parameters = Parameters::from([
        (LOSS.into(), bursts.loss),
        (SIDE.into(), bursts.side as f64),
        (BURST.into(), bursts.length_s),
        (SHARE.into(), bursts.share),
    ]);
    part.std = Parameters::from([(LOSS.into(), bursts.loss_std)]);
    part
}

/// The equation that a free form of this id lies in.
#[must_use]
pub fn equation_of(id: &str) -> Option<Equation> {
    use Equation::{
        Along, Force, Gyro, Moment, PoseAcross, PoseAlong, PoseHeading, Sideways, Turn, WheelLeft, WheelRight,
    };
    let mut words = id.split('.').skip(1);
    let first = words.next()?;
    let what = if matches!(first, "outliers" | "level" | "lattice") { words.next()? } else { first };
    Some(match what {
        "force" => Force,
        "moment" => Moment,
        "sideways" => Sideways,
        "along" => Along,
        "turn" => Turn,
        "wheel_left" | "wheels" => WheelLeft,
        "wheel_right" => WheelRight,
        "gyro" => Gyro,
        "pose_along" | "pose" | "position" => PoseAlong,
        "pose_across" => PoseAcross,
        "pose_heading" | "heading" => PoseHeading,
        _ => return None,
    })
}

/// Effects of the library that this drive cannot tell anything of, with their ids.
pub fn unknowable<'a>(
    record: &'a Record,
    effects: &'a [&'static dyn Driving],
) -> impl Iterator<Item = &'static str> + 'a {
    effects
        .iter()
        .filter(|e| {
            !knowable(**e, record) && matches!(e.explanation(), DriveExplanation::Model(_) | DriveExplanation::GyroStep)
        })
        .map(|e| e.about().id)
}
