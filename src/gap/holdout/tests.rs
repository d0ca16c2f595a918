//! The measures of the gap on simulated recordings whose truth is known.

use super::*;
use crate::gap::rest::state_space::{Coefficient, Markov, Run, StateSpaceModel, Telegraph};
use crate::math::random::Stream;

const ROWS: usize = 6000;

/// Nominal: white noise and a turn-on bias, 10 Hz.
fn nominal() -> StateSpaceModel {
    let mut believed = StateSpaceModel::white(ROWS, 0.1, 1e-3);
    believed.coefficients.push(Coefficient { column: vec![1.0; ROWS], mean: -4e-3, std: 2e-4 });
    believed
}

/// Reality: a Gauss-Markov bias of 20 s beside it.
fn truth() -> StateSpaceModel {
    let mut believed = nominal();
    believed.markov.push(Markov::gauss_markov(20.0, 1e-3, 0.1));
    believed
}

fn quick() -> Options {
    Options { draws: 400, ..Options::default() }
}

#[test]
fn a_true_model_reaches_the_floor_and_closes_the_gap() {
    let (before, after) = (nominal(), truth());
    let mut log_scores = Vec::new();
    let (mut inside_bands, mut bands) = (0, 0);
    for stream in 0..6 {
        let hold = after.simulate(100, stream).unwrap();
        let claims = [Claim { id: "truth", believed: &after }, Claim { id: "nominal", believed: &before }];
        let far = measure(&hold, &before, &after, &claims, &Options { seed: stream, ..quick() }).unwrap();
        assert_eq!(far.metrics[0].metric, "log_score");
        for m in &far.metrics {
            assert!(m.before.is_finite() && m.after.is_finite() && m.floor.is_finite(), "{m:?}");
        }
        log_scores.push(far.metrics[0].after - far.metrics[0].floor);
        // one recording's score scatters by sqrt(rows/2) nats, the gap is 0.35 nats a row or more
        let [low, high] = far.closed.ci95.unwrap();
        let closed = far.closed.estimate.unwrap();
        assert!((closed - 1.0).abs() < 0.2 && low < closed && closed < high, "{:?}", far.closed);
        assert_eq!(far.alone[0].1, far.closed);
        assert_eq!(far.alone[1].1.estimate, Some(0.0));
        assert!((far.closed.gained_nats / far.closed.expected_gain_nats - 1.0).abs() < 0.5, "{:?}", far.closed);
        // the heading drifts less where the bias is tracked, by what the floor says
        let drift = far.metrics.iter().find(|m| m.metric == "heading_drift_rms_rad_1s").unwrap();
        assert!(drift.after < 0.9 * drift.before && (drift.after / drift.floor - 1.0).abs() < 0.1, "{drift:?}");
        // the shape: the nominal simulator misses the slow part
        let allan = far.metrics.iter().find(|m| m.metric == "allan_deviation_ln_rms").unwrap();
        assert!(allan.after < 0.3 * allan.before && allan.after < 3.0 * allan.floor, "{allan:?}");
        let inside = |b: &&Band| b.augmented[0] < b.hold && b.hold < b.augmented[1];
        inside_bands += far.allan_deviation.iter().filter(inside).count();
        bands += far.allan_deviation.len();
    }
    // bands of two standard deviations; the long averaging times of one recording go up and down together
    assert!(inside_bands * 10 >= 8 * bands, "{inside_bands} of {bands}");
    // after minus floor: mean zero, one recording's standard deviation sqrt(1/(2 rows)), the floor's a little more
    let mean = log_scores.iter().sum::<f64>() / 6.0;
    let std = (0.5 / ROWS as f64 * (1.0 + 1.0 / 12.0) / 6.0).sqrt();
    assert!(mean.abs() < 4.0 * std, "{mean} {std}");
}

#[test]
fn without_a_gap_there_is_no_share() {
    let nominal = nominal();
    let hold = nominal.simulate(7, 0).unwrap();
    let far = measure(&hold, &nominal, &nominal, &[], &quick()).unwrap();
    assert_eq!((far.closed.estimate, far.closed.gained_nats), (None, 0.0));
    assert_eq!(far.metrics[0].before, far.metrics[0].after);
    assert!(far.notes.iter().any(|n| n.contains("no share to close")), "{:?}", far.notes);
    assert!(far.notes.iter().any(|n| n.contains("600 s")), "{:?}", far.notes);
}

#[test]
fn a_half_right_model_closes_part() {
    // two effects, one found: the share is below one and its interval excludes one
    let mut both = truth();
    both.telegraph = Some(Telegraph::centred(6e-3, [40.0, 40.0]));
    let hold = both.simulate(9, 1).unwrap();
    let (nominal, half) = (nominal(), truth());
    let claims = [Claim { id: "half", believed: &half }];
    let far = measure(&hold, &nominal, &both, &claims, &quick()).unwrap();
    let (all, half) = (far.closed, far.alone[0].1);
    assert!((all.estimate.unwrap() - 1.0).abs() < 0.1, "{all:?}");
    assert!(half.estimate.unwrap() < 0.99 && half.estimate.unwrap() > 0.0, "{half:?}");
    assert!(half.ci95.unwrap()[1] < all.ci95.unwrap()[1], "{half:?} {all:?}");
}

/// Scores of 4000 rows of white noise 1 + δ times as large as stated, of which an effect gains 40 nats on the recording and on
/// simulated ones alike.
fn louder(delta: f64) -> Closed {
    const LOGS: usize = 8;
    let (rows, gain) = (4000, 0.01);
    let score = |log: u64, size: f64| -> Vec<f64> {
        let mut draw = Stream::new(5, log);
        (0..rows).map(|_| -0.5 * (size * draw.normal()).powi(2)).collect()
    };
    let after = score(0, 1.0 + delta);
    let before: Vec<f64> = after.iter().map(|a| a - gain).collect();
    let floor: Vec<Vec<f64>> = (1..=LOGS as u64).map(|log| score(log, 1.0)).collect();
    let own_before: Vec<f64> = floor.iter().map(|f| f.iter().sum::<f64>() - gain * rows as f64).collect();
    let scores = Scores {
        before: &before,
        after: &after,
        floor: floor.iter().map(Vec::as_slice).collect(),
        own_before,
        level_nats: 0.0,
    };
    gap_closed(&scores, 40, &quick())
}

#[test]
fn noise_that_is_a_little_louder_is_no_other_cause() {
    // 4000 δ² = 6 nats have no name, and lower the score by 4000 δ = 155 nats, four times what the effect gains
    let little = louder((6.0_f64 / 4000.0).sqrt());
    assert!(little.paired && (little.estimate.unwrap() - 1.0).abs() < 0.3, "{little:?}");
    // six times as loud it is another cause
    let much = louder(5.0);
    assert!(!much.paired && much.ci95.unwrap()[1] < 0.1, "{much:?}");
}

#[test]
fn heading_drift_is_its_definition() {
    let believed = truth();
    let mut y = believed.simulate(2, 0).unwrap();
    y[3000..3005].fill(f64::NAN);
    let (_, horizons) = heading_horizons(ROWS, 0.1, &[10.0]);
    let run = believed.run(&y, &horizons).unwrap();
    let found = heading_errors(&y, &run, &horizons, 0.1)[0];
    let (mut sum, mut starts) = (0.0, 0);
    let mut row = horizons[0].first;
    while row + 100 <= ROWS {
        let mut known = y.clone();
        known[row..].fill(f64::NAN);
        // one start in ten by brute force; the others by their forecast
        let predicted: f64 = if starts % 10 == 0 {
            believed.score(&known).unwrap().predicted_rad_s[row..row + 100].iter().sum()
        } else {
            run.forecasts[0][starts].increment_rad / 0.1
        };
        let real: f64 = (row..row + 100).map(|k| if y[k].is_finite() { y[k] } else { run.predicted_rad_s[k] }).sum();
        sum += ((real - predicted) * 0.1).powi(2);
        starts += 1;
        row += horizons[0].every;
    }
    assert_eq!(found.starts, starts);
    assert!((found.rms_rad - (sum / starts as f64).sqrt()).abs() < 1e-12);
}

#[test]
fn intervals_cover_the_share_of_long_recordings() {
    // the share in expectation: gains and gaps averaged over many recordings
    let (before, after) = (nominal(), truth());
    let mut weak = nominal();
    weak.markov.push(Markov::gauss_markov(3.0, 5e-4, 0.1));
    let total = |model: &StateSpaceModel, y: &[f64]| model.score(y).unwrap();
    let logs: Vec<Vec<f64>> = (0..60).map(|s| after.simulate(50, s).unwrap()).collect();
    let runs: Vec<[Run; 3]> = logs.iter().map(|y| [total(&before, y), total(&weak, y), total(&after, y)]).collect();
    let sum = |at: usize| runs.iter().map(|r| r[at].total()).sum::<f64>();
    let share = (sum(1) - sum(0)) / (sum(2) - sum(0));
    let floor: Vec<Vec<f64>> = (0..12).map(|s| total(&after, &after.simulate(51, s).unwrap()).log_density).collect();
    let covered = runs
        .iter()
        .filter(|[b, w, _]| {
            let scores = Scores {
                before: &b.log_density,
                after: &w.log_density,
                floor: floor.iter().map(Vec::as_slice).collect(),
                own_before: vec![0.0; 12],
                level_nats: 0.0,
            };
            let rows = block_rows(scores.before, scores.after);
            let [low, high] = gap_closed(&scores, rows, &quick()).ci95.unwrap();
            low < share && share < high
        })
        .count();
    // 95 % of 60 is 57; a bootstrap of few dozen blocks loses some percent, the binomial scatter is 1.7
    assert!(covered >= 49, "{covered} of 60 cover {share}");
}

#[test]
fn the_whole_log_counts_where_a_thing_is_drawn_once() {
    // the turn-on bias lies five standard deviations off; the augmented simulator knows
    let before = nominal();
    let mut after = nominal();
    after.coefficients[0].mean += 1e-3;
    let hold = after.simulate(5, 0).unwrap();
    let options = Options { whole_log: true, ..quick() };
    let far = measure(&hold, &before, &after, &[], &options).unwrap();
    let m = &far.metrics[0];
    assert!((m.after - m.before - far.closed.gained_nats).abs() < 1e-6);
    // 25/2 nats, standard deviation 5, far below the scatter of sqrt(3000) nats of the total: measured in pairs
    assert!((2.0..35.0).contains(&far.closed.gained_nats), "{:?}", far.closed);
    assert!((7.0..20.0).contains(&far.closed.expected_gain_nats), "{:?}", far.closed);
    let [low, high] = far.closed.ci95.unwrap();
    assert!(far.closed.paired && low < 1.0 && 1.0 < high && high - low < 3.0, "{:?}", far.closed);
}

#[test]
fn pairs_do_not_ask_how_far_the_floor_is() {
    // the recording scores a tenth of a nat a row less than the floor for a reason that no effect has; all that is to be gained is
    let (before, after) = (vec![-0.1; ROWS], vec![-0.09; ROWS]);
    let floor = [vec![0.0; ROWS], vec![0.0; ROWS]];
    let scores = Scores {
        before: &before,
        after: &after,
        floor: floor.iter().map(Vec::as_slice).collect(),
        own_before: vec![-0.01 * ROWS as f64; 2],
        level_nats: 0.0,
    };
    let share = |in_pairs| gap_closed(&scores, 10, &Options { in_pairs, ..quick() }).estimate.unwrap();
    assert!((share(true) - 1.0).abs() < 1e-9 && (share(false) - 0.1).abs() < 1e-9);
}

#[test]
fn noise_that_is_louder_is_no_gap_that_an_effect_closes() {
    let (before, after) = (nominal(), truth());
    let mut draw = Stream::new(9, 9);
    // a variance of a tenth more: 6000/2 ln 1.1 = 286 nats of the floor, of a gap of some 2000
    let louder = 0.1_f64.sqrt() * 1e-3;
    let mut hold = after.simulate(7, 0).unwrap();
    hold.iter_mut().for_each(|y| *y += louder * draw.normal());
    let far = measure(&hold, &before, &after, &[], &quick()).unwrap();
    let m = &far.metrics[0];
    let by_floor = (m.after - m.before) / (m.floor - m.before);
    let closed = far.closed.estimate.unwrap();
    assert!(!far.closed.paired && by_floor < 0.95 && (closed - 1.0).abs() < 0.06, "{by_floor}, {:?}", far.closed);
}

#[test]
fn senseless_requests_are_refused() {
    let model = nominal();
    let y = vec![f64::NAN; ROWS];
    assert_eq!(measure(&y, &model, &model, &[], &quick()).unwrap_err().kind, ErrorKind::TooShort);
    let y = model.simulate(1, 0).unwrap();
    let one = Options { simulated_logs: 1, ..quick() };
    assert_eq!(measure(&y, &model, &model, &[], &one).unwrap_err().kind, ErrorKind::Usage);
}
