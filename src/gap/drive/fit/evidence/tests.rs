use super::*;

/// Three coefficients, of which the second has a group of its own, linearised beside zero.
fn problem() -> Problem {
    let root = [[1.4, 0.3, -0.2, 0.5], [0.0, 0.9, 0.4, -1.1], [0.0, 0.0, 1.2, 0.7], [0.0, 0.0, 0.0, 2.0]];
    let summed = Mat::from_fn(4, 4, |i, j| (0..4).map(|k| root[k][i] * root[k][j]).sum::<f64>());
    let group = |id: &str, columns: Vec<usize>| Group {
        id: id.into(),
        drive: 0,
        named: true,
        nodes: vec![vec![0.8; columns.len()]],
        columns,
        ln_prior: 0.0,
        rank: Rank::Law,
        positive: 0,
        varies: None,
    };
    let groups = vec![group("a", vec![1]), group("b", vec![2])];
    Problem::new(&summed, 3.0, &[0.0, 0.2, 0.0], groups, vec![Nuisance::new(0, 0.5)])
}

#[test]
fn the_density_integrates_to_the_evidence() {
    let (problem, members) = (problem(), [(0, 0), (1, 0)]);
    assert!((problem.ln_density(&members, &[]) - problem.ln_evidence(&members)).abs() < 1e-12);
    // over the first coefficient, by the trapezoid rule; it is a density up to √(2π)
    let step = 0.01;
    let density = |i: i32| problem.ln_density(&members, &[(1, step * f64::from(i))]).exp();
    let total: f64 = (-800..=800).map(density).sum::<f64>() * step / std::f64::consts::TAU.sqrt();
    let relative = total.ln() - problem.ln_evidence(&members);
    assert!(relative.abs() < 1e-9, "{relative:e}");
}

#[test]
fn a_path_that_follows_what_was_measured_is_a_function_of_it() {
    // the path's two columns can nearly be the form's one, which alone made the readings
    let overlap = [[1.0, 0.7, 0.7], [0.7, 1.0, 0.0], [0.7, 0.0, 1.0]];
    let size = 100.0;
    let summed = Mat::from_fn(4, 4, |i, j| match (i, j) {
        (3, 3) => size * size + 1e3,
        (3, k) | (k, 3) => size * overlap[k][0],
        (i, j) => overlap[i][j],
    });
    let group = |id: &str, columns: Vec<usize>, rank: Rank| Group {
        id: id.into(),
        drive: 0,
        named: rank == Rank::Process,
        nodes: vec![vec![size; columns.len()]],
        columns,
        ln_prior: 0.0,
        rank,
        positive: 0,
        varies: None,
    };
    let groups = vec![group("path", vec![1, 2], Rank::Process), group("form", vec![0], Rank::Form)];
    let problem = Problem::new(&summed, 0.0, &[0.0; 3], groups, Vec::new());
    let [path, form] = problem.shares(&[(0, 0), (1, 0)])[..] else { panic!() };
    assert!(form > 4900.0 && path < 0.0, "{form} {path}");
}

#[test]
fn what_every_robot_has_a_little_of_gives_way_to_the_effect() {
    let of = |usual| {
        let mut problem = problem();
        problem.nuisance[0].usual = usual;
        problem
    };
    let (always, usual) = (of(None), of(Some("a")));
    // beside any other effect it is there as always
    for members in [vec![], vec![(1, 0)]] {
        assert_eq!(always.ln_evidence(&members), usual.ln_evidence(&members));
    }
    // the effect itself holds it: no column but those of the members
    let columns: Vec<usize> = usual.coefficients(&[(0, 0), (1, 0)]).iter().map(|c| c.0).collect();
    assert_eq!(columns, [1, 2]);
    assert_eq!(always.coefficients(&[(0, 0), (1, 0)]).len(), 3);
    let mut alone = problem();
    alone.nuisance.clear();
    assert_eq!(alone.ln_weight(&[(0, 0), (1, 0)]), usual.ln_weight(&[(0, 0), (1, 0)]));
}

#[test]
fn shares_are_of_the_gap_of_a_simulator_that_has_nothing_of_the_effect() {
    let of = |usual| {
        let mut problem = problem();
        problem.nuisance[0].usual = usual;
        problem.shares(&[(0, 0), (1, 0)])
    };
    // without the column that every robot has a little of, as if the effect's own stood alone
    let mut alone = problem();
    alone.nuisance.clear();
    assert_eq!(of(Some("a")), alone.shares(&[(0, 0), (1, 0)]));
    assert_ne!(of(Some("a")), of(None));
}
