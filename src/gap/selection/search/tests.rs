use super::*;

/// Readings, and columns with unit prior odds e⁻³: ln weight = ½ |projection of the readings on the columns|² - 3 per column.
struct Columns {
    readings: Vec<f64>,
    columns: Vec<Vec<f64>>,
    /// The candidates from here on are free forms.
    named: usize,
}

const LN_PRIOR: f64 = -3.0;

impl Columns {
    fn ln_weight(&self, set: &[usize]) -> f64 {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut basis: Vec<Vec<f64>> = Vec::new();
        for c in set {
            let mut left = self.columns[*c].clone();
            for b in &basis {
                let along = dot(&left, b);
                left.iter_mut().zip(b).for_each(|(l, b)| *l -= along * b);
            }
            let size = dot(&left, &left).sqrt();
            if size > 1e-9 {
                basis.push(left.iter().map(|l| l / size).collect());
            }
        }
        basis.iter().map(|b| 0.5 * dot(b, &self.readings).powi(2)).sum::<f64>() + LN_PRIOR * set.len() as f64
    }

    /// All sets, the most probable first.
    fn all(&self) -> Vec<(Vec<usize>, f64)> {
        let set = |bits: usize| (0..self.columns.len()).filter(|c| bits >> c & 1 == 1).collect::<Vec<_>>();
        let weighed = (0..1 << self.columns.len()).map(set).map(|set| (set.clone(), self.ln_weight(&set)));
        let mut all: Vec<_> = weighed.collect();
        all.sort_by(|a, b| b.1.total_cmp(&a.1));
        all
    }
}

impl SetLikelihood for Columns {
    type Set = Vec<usize>;
    type Fitted = Vec<usize>;

    fn candidates(&self) -> usize {
        self.columns.len()
    }

    fn is_named(&self, candidate: usize) -> bool {
        candidate < self.named
    }

    fn set(fitted: &Vec<usize>) -> &Vec<usize> {
        fitted
    }

    fn members(set: &Vec<usize>) -> Vec<Member> {
        set.iter().map(|c| (*c, 0)).collect()
    }

    fn without(set: &Vec<usize>, candidate: usize) -> Vec<usize> {
        set.iter().copied().filter(|c| *c != candidate).collect()
    }

    fn fit(&self, start: &Vec<usize>) -> Weighed<Vec<usize>> {
        Weighed { fitted: start.clone(), ln_weight: self.ln_weight(start) }
    }

    fn extensions(&self, base: &Vec<usize>, candidates: &[usize]) -> Vec<Extension<Vec<usize>>> {
        let with = |c: &usize| [&base[..], &[*c]].concat();
        candidates.iter().map(|c| Some((with(c), self.ln_weight(&with(c)) - self.ln_weight(base)))).collect()
    }
}

/// Growth that drops members and begins again, and growth that may lose a little and leaves the rest to exchange.
const POLICIES: [Policy; 2] = [
    Policy { centres: 1, ..crate::gap::rest::whittle::search::POLICY },
    Policy { largest: 9, centres: 1, ..crate::gap::drive::fit::search::POLICY },
];

/// Two effects of this size, a free form near their sum, and two columns that explain nothing.
fn two_effects_and_their_sum(size: f64) -> Columns {
    let unit = |at: usize| (0..5).map(|i| f64::from(u8::from(i == at))).collect::<Vec<f64>>();
    let sum = vec![1.0, 1.0, 0.5, 0.0, 0.0];
    let columns = vec![unit(0), unit(1), unit(3), unit(4), sum];
    Columns { readings: vec![size, size, 0.0, 0.3, 0.0], columns, named: 4 }
}

#[test]
fn two_effects_take_the_place_of_a_free_form_that_explains_more_than_either() {
    let [regrows, exchanges] = POLICIES;
    // beside the free form a small effect gains nothing, and a large one little
    for (policy, size, gains) in [(regrows, 10.0, false), (regrows, 17.0, true), (exchanges, 17.0, true)] {
        let columns = two_effects_and_their_sum(size);
        assert!(columns.ln_weight(&[4]) > columns.ln_weight(&[0]).max(columns.ln_weight(&[1])) + 30.0);
        assert_eq!(columns.ln_weight(&[4, 0]) > columns.ln_weight(&[4]), gains);
        let best = Search::new(&columns, policy).run();
        let (set, ln_weight) = columns.all().swap_remove(0);
        assert_eq!(key_of::<Columns>(&best), key::<Columns>(&set), "{size} {policy:?}");
        assert!((best.ln_weight - ln_weight).abs() < 1e-9, "{size} {policy:?}");
    }
}

#[test]
fn every_probable_neighbour_of_the_best_set_takes_part_once() {
    let columns = two_effects_and_their_sum(17.0);
    for policy in POLICIES {
        let mut search = Search::new(&columns, policy);
        let best = search.run();
        let posterior = search.posterior();
        let keys: BTreeSet<_> = posterior.iter().map(key_of::<Columns>).collect();
        assert_eq!(keys.len(), posterior.len());
        assert!(posterior.is_sorted_by(|a, b| a.ln_weight >= b.ln_weight));
        let inside = inside::<Columns>(&best);
        for (set, ln_weight) in columns.all().into_iter().filter(|s| s.1 > best.ln_weight - policy.window + 1e-9) {
            let added = set.iter().filter(|c| !inside.contains(c)).count();
            let removed = inside.iter().filter(|c| !set.contains(c)).count();
            let is_met = keys.contains(&key::<Columns>(&set));
            assert!(is_met || added.max(removed) > 1, "{set:?} of {ln_weight} was not fitted: {policy:?}");
        }
    }
}
