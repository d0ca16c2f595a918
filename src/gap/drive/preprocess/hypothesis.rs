//! One interpretation of a drive: sets are compared where the best one lies, outliers removed, and noise levels
//! estimated from the residuals of a settled model.

use super::changepoint::Onsets;
use crate::effects::drive::Coordinate;
use crate::effects::{self, About, InDrives, Parameters};
use crate::gap::drive::ekf::innovations::{run, run_scoped};
use crate::gap::drive::ekf::noise::Noise;
use crate::gap::drive::fit::{Compared, Theta, models, models_at};
use crate::gap::drive::preprocess::level::{Level, Residual};
use crate::gap::drive::record::Record;
use crate::gap::drive::regressors::basis::{Column, Scoped};
use crate::gap::drive::regressors::candidates::Kind;
use crate::gap::selection::leave_out::LeftOut;
use crate::gap::selection::search::Member;
use crate::gap::selection::sets::{Part, WeightedSet};
use crate::gap::trace::Step;
use std::collections::BTreeSet;

/// Most sets that take part in the answer.
const SETS: usize = 60;

/// One interpretation of the drive: as it is, or with lost ticks restored.
pub(crate) struct PreprocessingHypothesis {
    pub(crate) record: Record,
    pub(crate) believed: Noise,
    pub(crate) noise: Noise,
    pub(crate) compared: Compared,
    /// Most likely time of a bias step in each drive, s since it began
    pub(crate) onsets_s: Onsets,
    /// Ids of the free forms that are retained in a large gap; none: all
    pub(crate) promising: Option<BTreeSet<String>>,
    /// Numbers of outliers removed: gyro, pose and wheels
    pub(crate) put_aside: [usize; 3],
    /// Whether lost ticks were restored: they are not searched again
    pub(crate) restored: bool,
    /// Nats closed by the restored ticks, as a law that may bend
    pub(crate) bent_nats: f64,
    pub(crate) extra_weight: f64,
    pub(crate) extra_parts: Vec<Part>,
    /// Named noise levels that are not as stated
    pub(crate) levels: Vec<Level>,
    /// Each effect of the best set left out
    pub(crate) left_out: Vec<LeftOut>,
    /// Steps of the trail.
    pub(crate) trace: Vec<Step>,
}

impl PreprocessingHypothesis {
    pub(crate) fn new(record: Record, noise: Noise, compared: Compared, onsets_s: Onsets) -> Self {
        let (promising, put_aside, extra_weight, extra_parts) = (None, [0; 3], 0.0, Vec::new());
        let believed = noise;
        let (restored, bent_nats) = (false, 0.0);
        let (levels, left_out, trace) = (Vec::new(), Vec::new(), Vec::new());
        Self {
            record,
            believed,
            noise,
            compared,
            onsets_s,
            promising,
            put_aside,
            restored,
            bent_nats,
            extra_weight,
            extra_parts,
            levels,
            left_out,
            trace,
        }
    }

    pub(crate) fn ln_likelihood(&self, noise: &Noise) -> f64 {
        self.ln_likelihood_at(&self.compared.theta, noise)
    }

    /// ln p of the readings with the changes at `theta`, nats.
    pub(crate) fn ln_likelihood_at(&self, theta: &Theta, noise: &Noise) -> f64 {
        let models = models_at(&self.record, &self.compared.candidates, theta);
        run(&self.record, &models, noise, &[], |_| {}).ln_likelihood()
    }

    /// Coefficient and standard deviation of the nuisance for the small amount of this effect that every robot has;
    /// none without one.
    pub(crate) fn usual(&self, id: &str) -> Option<(f64, f64)> {
        let c = &self.compared;
        let own = c.candidates.nuisance.iter().find(|n| n.usual == Some(id))?;
        let all = c.problem.coefficients(&c.sets[0].fitted);
        all.iter().find(|x| x.0 == own.column).map(|x| (x.1, x.2))
    }

    /// Whether its best set has no free form.
    pub(crate) fn is_named(&self) -> bool {
        self.compared.is_named()
    }

    /// Whether its best set has settled without a free form.
    pub(crate) fn is_settled(&self) -> bool {
        self.is_named() && self.compared.next().1
    }

    /// Whether its best set has settled, and no free form or further part is needed.
    pub(crate) fn is_quiet(&self) -> bool {
        self.extra_parts.is_empty() && self.is_settled()
    }

    /// Whether its best set is one effect, settled, and nothing else is needed.
    pub(crate) fn is_told_by_one(&self) -> bool {
        self.compared.sets[0].fitted.len() == 1 && self.is_quiet()
    }

    pub(crate) fn top(&self) -> f64 {
        self.compared.top() + self.extra_weight
    }

    /// `groups`, ascending, with those of the coordinates that vary in them: a varying column is computed from that of
    /// its coordinate.
    fn with_coordinates(&self, groups: impl Iterator<Item = usize>) -> BTreeSet<usize> {
        let kinds = &self.compared.candidates.kinds;
        let constant = |g: usize| match kinds[g] {
            Kind::Varying(i) => kinds.iter().position(|k| matches!(k, Kind::Change(j) if *j == i)),
            _ => None,
        };
        groups.flat_map(|g| [Some(g), constant(g)]).flatten().collect()
    }

    /// Innovations under the best set, at the posterior mean of its coefficients.
    pub(crate) fn residuals(&self) -> Vec<Residual> {
        let c = &self.compared;
        let members = &c.sets[0].fitted;
        let inside = self.with_coordinates(members.iter().map(|m| m.0));
        let few = c.candidates.only(|g| inside.contains(&g));
        let coefficients = c.problem.coefficients(members);
        // columns keep their order: nuisances first, then the members'
        let mut wide: Vec<usize> = c.candidates.nuisance.iter().map(|n| n.column).collect();
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
                match kind.column {
                    Column::Coordinate(i, j) => total - c.theta[i][j],
                    _ => total,
                }
            })
            .collect();
        let models = models(&self.record, &few.change_list(), &c.theta, true);
        let mut out = Vec::new();
        let _ = run_scoped(&self.record, &models, &self.noise, &few.columns, |i| {
            let explained: f64 = i.slopes.iter().zip(&here).map(|(s, b)| s * b).sum();
            out.push((i.channel, i.row, i.white - explained, i.std));
        });
        out
    }

    /// Adds a part; with one of the same id it is merged.
    pub(crate) fn add(&mut self, mut part: Part) {
        if let Some(at) = self.extra_parts.iter().position(|p| p.id == part.id) {
            part.share += self.extra_parts.swap_remove(at).share;
        }
        self.extra_parts.push(part);
    }

    pub(crate) fn sets(&self) -> Vec<WeightedSet> {
        let c = &self.compared;
        // shares are counted with the believed noise, before larger noise lowers them
        let believed = Noise { process: self.noise.process, ..self.believed };
        let changed = believed != self.noise && self.record.torques_n_m.is_some();
        let told = || c.sets.iter().take(SETS);
        let inside = self.with_coordinates(told().flat_map(|w| w.fitted.iter().map(|m| m.0)));
        let few = changed.then(|| c.candidates.only(|g| inside.contains(&g)));
        let with_believed = few.map(|few| few.linearise(&self.record, &believed, &c.theta));
        let part = |members: &[Member]| -> Vec<Part> {
            let place = |m: &Member| inside.iter().position(|g| *g == m.0).map(|place| (place, m.1));
            let shares = match &with_believed {
                Some(problem) => problem.shares(&members.iter().filter_map(place).collect::<Vec<_>>()),
                None => c.problem.shares(members),
            };
            let coefficients = c.problem.coefficients(members);
            one_an_id(members.iter().zip(shares).map(|(&(g, _), share)| self.part(g, share, &coefficients)))
        };
        let whole = told().map(|w| WeightedSet {
            parts: part(&w.fitted).into_iter().chain(self.extra_parts.iter().cloned()).collect(),
            ln_weight: w.ln_weight + self.extra_weight,
            probability: 0.0,
        });
        // a level that gains little over its cost may be absent
        let mut sets: Vec<WeightedSet> = whole.collect();
        for level in &self.levels {
            let without = |set: &WeightedSet| WeightedSet {
                parts: set.parts.iter().filter(|p| p.id != level.about.id).cloned().collect(),
                ln_weight: set.ln_weight - level.margin,
                probability: 0.0,
            };
            let others: Vec<WeightedSet> = sets.iter().map(without).collect();
            sets.extend(others);
        }
        sets
    }

    pub(crate) fn part(
        &self,
        group: usize,
        share: f64,
        coefficients: &crate::gap::drive::fit::evidence::Coefficients,
    ) -> Part {
        let candidates = &self.compared.candidates;
        let g = &candidates.groups[group];
        let value = |column: usize| coefficients.iter().find(|c| c.0 == column).map_or((0.0, 0.0), |c| (c.1, c.2));
        let mut part = Part::new(&g.id, g.named, share);
        match candidates.kinds[group] {
            Kind::Change(i) => {
                let change = candidates.changes[i].1;
                let inside = |(c, own): (&usize, &Coordinate)| value(*c).0.clamp(own.bounds[0], own.bounds[1]);
                let theta: Vec<f64> = g.columns.iter().zip(change.coordinates()).map(inside).collect();
                part.parameters = change.parameters(&theta);
                let at_rims = self.noise.process.at_rims / self.record.belief.torque_noise_n_m_sqrt_s.powi(2);
                if let Some(name) = change.torque_noise_share().filter(|_| at_rims > 0.0) {
                    part.parameters.insert(name.into(), at_rims.sqrt());
                }
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
            Kind::Step(drive, t) => {
                let (step, std) = value(g.columns[0]);
                let name = effects::drive::by_id(&g.id).map_or("", |e| e.about().size());
                part.parameters = Parameters::from([(name.into(), step)]);
                part.std = Parameters::from([(name.into(), std)]);
                let at = self.record.times_s[self.record.starts[drive]] + t;
                part.time_s = Some([at, at]);
                if self.record.starts.len() > 1 {
                    part.description = format!("the bias jumps at {at:.2} s of {}", self.record.sources[drive]);
                }
            }
            Kind::Walk => {
                // K from the sum of squares of its cosines: coefficient n is K √(2T)/(nπ)
                let spans = self.record.spans_s();
                let squares = g.columns.iter().map(|c| {
                    let (mean, std) = value(*c);
                    let Scoped { column: Column::GyroCosine(n), drive } = candidates.columns[*c] else { return 0.0 };
                    let unit = std::f64::consts::SQRT_2 / (n as f64 * std::f64::consts::PI);
                    (mean * mean + std * std) / (unit * unit * spans[drive.unwrap_or(0)])
                });
                let k = (squares.sum::<f64>() / g.columns.len() as f64).sqrt();
                let relative = (0.5 / g.columns.len() as f64).sqrt();
                let name = effects::in_drives(InDrives::Walk).map_or("", About::size);
                part.parameters = Parameters::from([(name.into(), k)]);
                part.std = Parameters::from([(name.into(), k * relative)]);
            }
            Kind::Varying(i) => {
                let title = candidates.changes[i].0.about().title;
                let drives = if self.record.starts.len() > 1 { ", from drive to drive" } else { "" };
                part.description =
                    format!("{title} that is not constant: it varies with time, speed or acceleration{drives}");
            }
            Kind::Free(equation, follows) => {
                part.description =
                    format!("{}: something that follows {}", equation.words(), follows.id().replace('_', " "));
            }
        }
        part
    }
}

/// Merges parts of one id, as of effects drawn anew in each drive: the sum of the shares, the parameters of the
/// largest.
fn one_an_id(parts: impl Iterator<Item = Part>) -> Vec<Part> {
    let mut all: Vec<(f64, Part)> = Vec::new();
    for part in parts {
        match all.iter_mut().find(|(_, p)| p.id == part.id) {
            Some((most, there)) => {
                let share = there.share + part.share;
                if part.share > *most {
                    *most = part.share;
                    *there = part;
                }
                there.share = share;
            }
            None => all.push((part.share, part)),
        }
    }
    all.into_iter().map(|(_, part)| part).collect()
}
