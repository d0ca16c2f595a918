//! ln p(z | set) = -½ yy - ½ ln det(I + U G U) + ½ b'(G + U⁻²)⁻¹ b,   U = diag of prior standard deviations
//!
//! Gaussian comparison of sets of groups of columns from their Gram matrix alone: G = Σ slopes slopes', b = Σ slopes ν.
//! Each group has a prior N(0, s² diag(unit²)) whose scale s lies on a grid, every node equally probable.

use crate::gap::selection::leave_out;
use crate::gap::selection::search::{Member, Weighed};
use crate::math::registers::free_upper_halves;
use faer::linalg::solvers::{Llt, Solve};
use faer::{Mat, Side};

/// Order in which the shares of groups that explain the same are counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Rank {
    /// An effect with a law
    Law,
    /// A free form: a function of something that was measured, or a coefficient that varies
    Form,
    /// A process: its path is random
    Process,
    /// A function of time, in the place of a process's path
    Path,
}

impl Rank {
    const ALL: [Self; 4] = [Self::Law, Self::Form, Self::Process, Self::Path];
}

/// Columns that enter a set together.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Group {
    /// Identifier of the effect, or of a free form.
    pub id: String,
    /// Index of the drive in which it acts, for effects that are drawn anew in each run; else zero. A set holds one of
    /// each id and drive.
    pub drive: usize,
    /// Whether it is an effect of the library.
    pub named: bool,
    /// Its columns.
    pub columns: Vec<usize>,
    /// Prior standard deviation of each column's coefficient at each node.
    pub nodes: Vec<Vec<f64>>,
    /// ln of its prior odds.
    pub ln_prior: f64,
    /// Its share is counted beyond those of lower rank.
    pub rank: Rank,
    /// Number of its first coefficients that cannot be negative.
    pub positive: usize,
    /// Column whose coefficient varies in this group: the group's columns are multiples of it, row by row.
    pub varies: Option<usize>,
}

/// A column of every set.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Nuisance {
    /// The column.
    pub column: usize,
    /// Prior standard deviation of its coefficient.
    pub std: f64,
    /// The effect of which every robot has this small amount, if there is one: in a set with the effect, that holds the
    /// coefficient.
    pub usual: Option<&'static str>,
}

impl Nuisance {
    /// A nuisance without such an effect.
    #[must_use]
    pub(crate) fn new(column: usize, std: f64) -> Self {
        Self { column, std, usual: None }
    }
}

/// Normal equations of one linearisation, in total coefficients (not differences from it).
pub(crate) struct Problem {
    /// Of the columns, the innovations in the last row and column
    gram: Mat<f64>,
    ln_volume: f64,
    moment: Vec<f64>,
    /// Σ z² + Σ ln 2πS
    null: f64,
    groups: Vec<Group>,
    nuisance: Vec<Nuisance>,
}

/// Coefficients of a set: column, estimate, standard deviation.
pub(crate) type Coefficients = Vec<(usize, f64, f64)>;

/// Posterior of a set: columns, Cholesky factor of the scaled normal equations, mean coefficients, ln evidence.
struct Conditioned {
    columns: Vec<usize>,
    factor: Llt<f64>,
    mean: Vec<f64>,
    ln_evidence: f64,
}

/// Multiple of the widest prior standard deviation beyond which an effect is not plausible.
const FAR: f64 = 4.0;
/// Cost of twice that, nats.
const IMPLAUSIBLE: f64 = 1e4;
/// Share of an effect's energy that may vary until another cause is as likely.
const CONSTANT: f64 = 0.1;
/// Lower limit in place of zero.
const TINY: f64 = 1e-12;

impl Problem {
    /// From the Gram matrix with the innovations as its last column, linearised at `here` (by column; zero where
    /// linear).
    #[must_use]
    pub(crate) fn new(
        summed: &Mat<f64>,
        ln_volume: f64,
        here: &[f64],
        groups: Vec<Group>,
        nuisance: Vec<Nuisance>,
    ) -> Self {
        let p = summed.ncols() - 1;
        let gram = summed.clone();
        let product: Vec<f64> = (0..p).map(|i| (0..p).map(|j| gram[(i, j)] * here[j]).sum()).collect();
        let b: Vec<f64> = (0..p).map(|i| summed[(i, p)]).collect();
        let cross: f64 = here.iter().zip(&b).map(|(h, b)| h * b).sum();
        let square: f64 = here.iter().zip(&product).map(|(h, g)| h * g).sum();
        let moment = b.iter().zip(&product).map(|(b, g)| b + g).collect();
        Self { gram, ln_volume, moment, null: summed[(p, p)] + 2.0 * cross + square + ln_volume, groups, nuisance }
    }

    /// Gram matrix of these columns, with the innovations in the last row and column, and Σ ln 2πS.
    #[must_use]
    pub(crate) fn summed_of(&self, columns: &[usize]) -> (Mat<f64>, f64) {
        let at = |i: usize| columns.get(i).copied().unwrap_or(self.moment.len());
        (Mat::from_fn(columns.len() + 1, columns.len() + 1, |i, j| self.gram[(at(i), at(j))]), self.ln_volume)
    }

    /// The groups of columns: the candidates.
    #[must_use]
    pub(crate) fn groups(&self) -> &[Group] {
        &self.groups
    }

    /// Nuisances whose effect is not in the set.
    fn nuisances(&self, members: &[Member]) -> impl Iterator<Item = &Nuisance> {
        let held = |id: &str| members.iter().any(|m| self.groups[m.0].id == id);
        self.nuisance.iter().filter(move |n| !n.usual.is_some_and(held))
    }

    fn prior(&self, members: &[Member]) -> (Vec<usize>, Vec<f64>) {
        self.prior_within(members, members)
    }

    /// Columns and prior standard deviations of `members`, a part of the set `whole`: what every robot has of an effect
    /// of `whole` is zero where the effect is left out.
    fn prior_within(&self, members: &[Member], whole: &[Member]) -> (Vec<usize>, Vec<f64>) {
        let (mut columns, mut stds): (Vec<usize>, Vec<f64>) = self.nuisances(whole).map(|n| (n.column, n.std)).unzip();
        for &(g, node) in members {
            columns.extend(&self.groups[g].columns);
            stds.extend(&self.groups[g].nodes[node]);
        }
        (columns, stds)
    }

    fn condition(&self, members: &[Member]) -> Option<Conditioned> {
        let (columns, stds) = self.prior(members);
        self.integrated(columns, &stds, |c| self.moment[c], self.null)
    }

    /// Posterior of `columns` with the moments `moment`; `null`: Σ z² + Σ ln 2πS without them.
    fn integrated(
        &self,
        columns: Vec<usize>,
        stds: &[f64],
        moment: impl Fn(usize) -> f64,
        null: f64,
    ) -> Option<Conditioned> {
        let n = columns.len();
        // in units of the prior: I + U G U
        let scaled = Mat::from_fn(n, n, |i, j| {
            stds[i] * self.gram[(columns[i], columns[j])] * stds[j] + f64::from(u8::from(i == j))
        });
        let factor = scaled.llt(Side::Lower).ok()?;
        let l = factor.L();
        let ln_det: f64 = (0..n).map(|i| 2.0 * l[(i, i)].ln()).sum();
        let b = Mat::from_fn(n, 1, |i, _| stds[i] * moment(columns[i]));
        let x = factor.solve(&b);
        free_upper_halves();
        let gain: f64 = (0..n).map(|i| b[(i, 0)] * x[(i, 0)]).sum();
        let mean = (0..n).map(|i| stds[i] * x[(i, 0)]).collect();
        Some(Conditioned { columns, factor, mean, ln_evidence: -0.5 * (null + ln_det - gain) })
    }

    /// ln evidence of the set: ln p of the drive, without the set's prior odds.
    #[must_use]
    pub(crate) fn ln_evidence(&self, members: &[Member]) -> f64 {
        self.condition(members).map_or(f64::NEG_INFINITY, |c| c.ln_evidence)
    }

    /// ln weight of the set: evidence, prior odds, and the cost of unknown scales.
    #[must_use]
    pub(crate) fn ln_weight(&self, members: &[Member]) -> f64 {
        let Some(inside) = self.condition(members) else { return f64::NEG_INFINITY };
        let priors: f64 =
            members.iter().map(|&(g, _)| self.groups[g].ln_prior - (self.groups[g].nodes.len() as f64).ln()).sum();
        let half = members.iter().any(|&(g, _)| self.groups[g].positive > 0);
        let possible = if half {
            let coefficients = self.coefficients_in(members, &inside);
            let of =
                |c: usize| coefficients.iter().find(|x| x.0 == c).map_or(0.0, |x| ln_possible(x.1 / x.2.max(TINY)));
            let positive = |g: usize| self.groups[g].columns[..self.groups[g].positive].iter();
            members.iter().flat_map(|&(g, _)| positive(g)).map(|c| of(*c)).sum()
        } else {
            0.0
        };
        inside.ln_evidence + priors + possible - self.implausible(members, &inside)
    }

    /// ln density of the drive, the set and its coefficients that are `pinned` (column and value); all others are
    /// integrated out. Exact at the point of linearisation, whatever the range of that.
    #[must_use]
    pub(crate) fn ln_density(&self, members: &[Member], pinned: &[(usize, f64)]) -> f64 {
        let (columns, stds) = self.prior(members);
        let pulls = |c: usize| pinned.iter().map(|p| self.gram[(c, p.0)] * p.1).sum::<f64>();
        let mut null = self.null;
        let (mut rest, mut rest_stds) = (Vec::with_capacity(columns.len()), Vec::with_capacity(columns.len()));
        for (column, std) in columns.into_iter().zip(stds) {
            if let Some((_, value)) = pinned.iter().find(|p| p.0 == column) {
                null += value * (pulls(column) - 2.0 * self.moment[column]) + (value / std).powi(2) + 2.0 * std.ln();
            } else {
                rest.push(column);
                rest_stds.push(std);
            }
        }
        let inside = self.integrated(rest, &rest_stds, |c| self.moment[c] - pulls(c), null);
        let priors: f64 = members.iter().map(|m| self.groups[m.0].ln_prior).sum();
        inside.map_or(f64::NEG_INFINITY, |c| priors + c.ln_evidence)
    }

    /// Cost of effects' coefficients far beyond their widest prior, nats: in directions that a drive hardly tells they
    /// would diverge.
    fn implausible(&self, members: &[Member], inside: &Conditioned) -> f64 {
        let mut at = self.nuisances(members).count();
        let mut cost = 0.0;
        for &(g, _) in members {
            let group = &self.groups[g];
            for (i, mean) in inside.mean[at..at + group.columns.len()].iter().enumerate() {
                let widest = group.nodes.last().map_or(f64::INFINITY, |n| n[i]);
                let excess = mean.abs() / (FAR * widest) - 1.0;
                cost += if group.named && excess > 0.0 { IMPLAUSIBLE * excess } else { 0.0 };
            }
            at += group.columns.len();
        }
        cost
    }

    /// Every group outside `members` with its best node, and the gain in ln weight when it is added.
    #[must_use]
    pub(crate) fn additions(&self, members: &[Member]) -> Vec<(Member, f64)> {
        let Some(inside) = self.condition(members) else { return Vec::new() };
        let (_, stds) = self.prior(members);
        let n = inside.columns.len();
        let same = |a: &Group, b: &Group| a.id == b.id && a.drive == b.drive;
        let taken = |g: &Group| members.iter().any(|&(m, _)| same(&self.groups[m], g));
        let open: Vec<usize> = (0..self.groups.len()).filter(|g| !taken(&self.groups[*g])).collect();
        let columns: Vec<usize> = open.iter().flat_map(|g| self.groups[*g].columns.clone()).collect();
        // U G_in,out and its solution
        let cross = Mat::from_fn(n, columns.len(), |i, j| stds[i] * self.gram[(inside.columns[i], columns[j])]);
        let solved = inside.factor.solve(&cross);
        free_upper_halves();
        let mut at = 0;
        let mut out = Vec::with_capacity(open.len());
        for g in open {
            let group = &self.groups[g];
            let k = group.columns.len();
            let conditional = |i: usize, j: usize| {
                let taken: f64 = (0..n).map(|r| cross[(r, at + i)] * solved[(r, at + j)]).sum();
                self.gram[(group.columns[i], group.columns[j])] - taken
            };
            let gram: Vec<f64> = (0..k * k).map(|m| conditional(m / k, m % k)).collect();
            let moment: Vec<f64> = (0..k)
                .map(|i| {
                    let explained: f64 =
                        (0..n).map(|r| self.gram[(inside.columns[r], group.columns[i])] * inside.mean[r]).sum();
                    self.moment[group.columns[i]] - explained
                })
                .collect();
            at += k;
            if let Some((node, gain)) = best_node(group, &gram, &moment) {
                out.push(((g, node), gain + group.ln_prior));
            }
        }
        out
    }

    /// All groups together, each with the node of its prior that explains most beside the others; of groups with one
    /// id, the one that explains most.
    #[must_use]
    pub(crate) fn together(&self) -> Weighed<Vec<Member>> {
        let mut open: Vec<&str> = self.groups.iter().map(|g| g.id.as_str()).collect();
        open.sort_unstable();
        open.dedup();
        let all = open.clone();
        let most = |rest: &[Member], ids: &[&str]| {
            let of = |m: &(Member, f64)| ids.contains(&self.groups[m.0.0].id.as_str());
            self.additions(rest).into_iter().filter(of).max_by(|a, b| a.1.total_cmp(&b.1)).map(|m| m.0)
        };
        let mut members: Vec<Member> = Vec::new();
        while let Some(next) = most(&members, &open) {
            open.retain(|id| *id != self.groups[next.0].id);
            members.push(next);
        }
        for id in all {
            let rest: Vec<Member> = members.iter().copied().filter(|m| self.groups[m.0].id != id).collect();
            if let Some(again) = most(&rest, &[id]) {
                members = rest;
                members.push(again);
            }
        }
        members.sort_unstable();
        Weighed { ln_weight: self.ln_weight(&members), fitted: members }
    }

    /// The same with the readings that the set predicts on average: moments G β at its posterior mean β.
    #[must_use]
    pub(crate) fn expected(&self, members: &[Member]) -> Self {
        let coefficients = self.coefficients(members);
        let moment = |i: usize| coefficients.iter().map(|(j, mean, _)| self.gram[(i, *j)] * mean).sum();
        let moment: Vec<f64> = (0..self.moment.len()).map(moment).collect();
        let null = coefficients.iter().map(|(j, mean, _)| mean * moment[*j]).sum();
        let (groups, nuisance) = (self.groups.clone(), self.nuisance.clone());
        Self { gram: self.gram.clone(), ln_volume: self.ln_volume, moment, null, groups, nuisance }
    }

    /// Posterior mean and standard deviation of every coefficient of the set.
    #[must_use]
    pub(crate) fn coefficients(&self, members: &[Member]) -> Coefficients {
        self.condition(members).map_or_else(Vec::new, |inside| self.coefficients_in(members, &inside))
    }

    fn coefficients_in(&self, members: &[Member], inside: &Conditioned) -> Coefficients {
        let (_, stds) = self.prior(members);
        let n = inside.columns.len();
        let inverse = inside.factor.solve(&Mat::<f64>::identity(n, n));
        free_upper_halves();
        (0..n).map(|i| (inside.columns[i], inside.mean[i], stds[i] * inverse[(i, i)].max(0.0).sqrt())).collect()
    }

    /// Share of each member, nats of evidence, with the coefficients of the others fitted anew each time. Shares are of
    /// the gap of the nominal simulator, which has nothing of an effect, not even what every robot has.
    ///
    /// The ranks are counted in order, each beyond those before it. Laws come first: a free form that can be anything
    /// can also be what a law says, and a law needs no more. Likewise the path of a process can be any slow function of
    /// a measured quantity, and no random path follows a heading by chance. Within a rank the share is the mean of the
    /// gains when a member is added first, alone, and last, beside all others of the rank: two of the orders that
    /// Shapley's value is the mean of.
    #[must_use]
    pub(crate) fn shares(&self, members: &[Member]) -> Vec<f64> {
        let mut shares = vec![0.0; members.len()];
        let mut before: Vec<Member> = Vec::new();
        for rank in Rank::ALL {
            let here: Vec<usize> = (0..members.len()).filter(|i| self.groups[members[*i].0].rank == rank).collect();
            let with = |keep: &dyn Fn(usize) -> bool| -> f64 {
                let own = here.iter().filter(|i| keep(**i)).map(|i| members[*i]);
                let mut set: Vec<Member> = before.iter().copied().chain(own).collect();
                set.sort_unstable();
                let (columns, stds) = self.prior_within(&set, members);
                let inside = self.integrated(columns, &stds, |c| self.moment[c], self.null);
                inside.map_or(f64::NEG_INFINITY, |c| c.ln_evidence)
            };
            here.iter().zip(leave_out::shares(&here, with)).for_each(|(i, share)| shares[*i] = share);
            before.extend(here.iter().map(|i| members[*i]));
        }
        for (from, to, moves) in self.inconstant(members) {
            let moved = moves * shares[from].max(0.0);
            shares[from] -= moved;
            shares[to] += moved;
        }
        shares
    }

    /// Effects of the set whose coefficient is not constant: index of the effect, index of its varying part, and the
    /// part of the effect's share that belongs to the latter, as the cause only resembles the effect. With the energies
    /// E of the constant and V of the varying part in the whitened innovations it is V/(V + E/10): V = E/10 refutes by
    /// half.
    fn inconstant(&self, members: &[Member]) -> Vec<(usize, usize, f64)> {
        let varying: Vec<usize> = (0..members.len()).filter(|i| self.groups[members[*i].0].varies.is_some()).collect();
        if varying.is_empty() {
            return Vec::new();
        }
        let coefficients = self.coefficients(members);
        let energy = |g: usize| -> f64 {
            let columns = &self.groups[g].columns;
            let of = |c: usize| coefficients.iter().find(|x| x.0 == c).map_or(0.0, |x| x.1);
            columns
                .iter()
                .flat_map(|a| columns.iter().map(move |b| (*a, *b)))
                .map(|(a, b)| of(a) * self.gram[(a, b)] * of(b))
                .sum()
        };
        let pair = |to: usize| {
            let constant = self.groups[members[to].0].varies?;
            let from = members.iter().position(|m| self.groups[m.0].columns.first() == Some(&constant))?;
            let (rest, whole) = (energy(members[to].0), energy(members[from].0));
            Some((from, to, rest / (rest + CONSTANT * whole).max(TINY)))
        };
        varying.into_iter().filter_map(pair).collect()
    }
}

/// The node with the most evidence, and ln of the mean evidence of all nodes; none where that is not finite.
fn best_node(group: &Group, gram: &[f64], moment: &[f64]) -> Option<(usize, f64)> {
    let k = moment.len();
    let mut factor = vec![0.0; k * k];
    let mut solved = vec![0.0; k];
    let mut gains = Vec::with_capacity(group.nodes.len());
    for stds in &group.nodes {
        // I + U G U = L L', and L⁻¹ U b
        let mut gain = 0.0;
        for i in 0..k {
            for j in 0..=i {
                let mut sum = stds[i] * gram[i * k + j] * stds[j] + f64::from(u8::from(i == j));
                for m in 0..j {
                    sum -= factor[i * k + m] * factor[j * k + m];
                }
                factor[i * k + j] = if i == j { sum.max(TINY).sqrt() } else { sum / factor[j * k + j] };
            }
            let mut sum = stds[i] * moment[i];
            for m in 0..i {
                sum -= factor[i * k + m] * solved[m];
            }
            solved[i] = sum / factor[i * k + i];
            gain += 0.5 * solved[i] * solved[i] - factor[i * k + i].ln();
        }
        if group.positive > 0 {
            // half of the prior is impossible: the posterior's share in the other half
            let scaled = stds[0] * stds[0] * gram[0];
            gain += ln_possible(stds[0] * moment[0] / (1.0 + scaled).sqrt());
        }
        gains.push(gain);
    }
    let node = (0..gains.len()).max_by(|a, b| gains[*a].total_cmp(&gains[*b]))?;
    let top = gains[node];
    let mean = gains.iter().map(|g| (g - top).exp()).sum::<f64>() / gains.len() as f64;
    (top.is_finite()).then(|| (node, top + mean.ln()))
}

/// ln 2Φ(z): gain in evidence by a prior without its negative half, z being the posterior mean over its standard
/// deviation.
pub(crate) fn ln_possible(z: f64) -> f64 {
    statrs::function::erf::erfc(-z / std::f64::consts::SQRT_2).max(1e-300).ln()
}

#[cfg(test)]
mod tests;
