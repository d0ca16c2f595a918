//! One run: a simulated drive, and the errors of each estimator in it.

use super::setup::{Estimator, Setup};
use crate::config::Config;
use crate::error::Result;
use crate::navigate::{
    ErrorModel, Filter, Innovation, Input, MotionModel, RollingFilter, Sensor, Settings, SlipFilter, UnscentedFilter,
    dead_reckoning, state, wrap_angle,
};
use crate::signal::{Log, names};
use crate::simulate::{Drive, Options, drive, truth_names};
use crate::vehicle::{Forcing, Motion, Rolling, advance};
use nalgebra::{Matrix3, Vector3};

/// Rows that are kept for the curves, 1/s.
const KEPT_PER_S: f64 = 10.0;

/// Errors of one run.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RunErrors {
    /// Times of the kept rows, s.
    pub times_s: Vec<f64>,
    /// Errors of each estimator.
    pub estimators: Vec<EstimatorErrors>,
    /// The run itself, where it was asked for.
    pub example: Option<Example>,
}

/// Errors of one estimator in one run.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct EstimatorErrors {
    /// The estimator.
    pub estimator: Estimator,
    /// Mean squares of x, y (m²) and heading (rad²) over all rows.
    pub mean_squares: [f64; 3],
    /// Errors in x, y (m) and heading (rad) at the kept rows.
    pub errors: Vec<[f64; 3]>,
    /// NEES of (x, y, θ) at the kept rows, where the estimator has a covariance.
    pub nees: Option<Vec<f64>>,
    /// Mean NIS, where the estimator has one.
    pub nis: Option<f64>,
}

/// One run against its estimates, at the kept rows.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Example {
    /// Times, s.
    pub times_s: Vec<f64>,
    /// True x, y (m) and heading (rad).
    pub truth: Vec<[f64; 3]>,
    /// Estimates of x, y (m) and heading (rad).
    pub estimates: Vec<(Estimator, Vec<[f64; 3]>)>,
    /// True slip of the left and the right wheel.
    pub true_slips: Vec<[f64; 2]>,
    /// Slip as the filter estimates it, left and right, each with its standard deviation.
    pub slips: Vec<[[f64; 2]; 2]>,
}

/// Simulates run `index` and runs every estimator over it.
///
/// # Errors
/// Errors of the simulator and of the filters.
pub(crate) fn run_errors(setup: &Setup, index: usize, with_example: bool) -> Result<RunErrors> {
    let options = Options {
        since_power_on_s: setup.since_power_on_s,
        vary_turn_on: varies(&setup.truth),
        ..Options::from(setup.run_seed(index))
    };
    let drive = drive(&setup.truth, setup.course, setup.duration_s, &options)?;
    let every = ((1.0 / KEPT_PER_S) / drive.log.time.median_step_s()).round().max(1.0) as usize;
    let rows = Rows::new(&drive, every)?;
    let config = &setup.believed;
    let modelled = Settings::default();
    let unmodelled = Settings { error_model: ErrorModel::Off, ..Settings::default() };
    let t0 = setup.since_power_on_s;

    let mut tracks = Vec::with_capacity(setup.estimators.len());
    for &estimator in &setup.estimators {
        tracks.push(match estimator {
            Estimator::Slip => rows.filter(estimator, SlipFilter::new(config, &modelled, t0)?.0),
            Estimator::Rolling => rows.filter(estimator, RollingFilter::new(config, &modelled, t0)?.0),
            Estimator::SlipWithoutErrorModel => rows.filter(estimator, SlipFilter::new(config, &unmodelled, t0)?.0),
            Estimator::RollingWithoutErrorModel => {
                rows.filter(estimator, RollingFilter::new(config, &unmodelled, t0)?.0)
            }
            Estimator::SlipUnscented => {
                rows.filter(estimator, UnscentedFilter::from(SlipFilter::new(config, &modelled, t0)?.0))
            }
            Estimator::DeadReckoning => {
                rows.reckoned(estimator, dead_reckoning(config, &drive.log, &modelled)?.motion.into_iter())
            }
            Estimator::GyroReckoning => rows.reckoned(estimator, rows.by_gyro(config, |_| 0.0)?),
            Estimator::GyroReckoningZeroed => {
                let zero = rows.gyro_at_rest();
                rows.reckoned(estimator, rows.by_gyro(config, move |_| zero)?)
            }
            Estimator::GyroReckoningModelled => {
                let model = config.require_gyro()?.warm_up();
                rows.reckoned(estimator, rows.by_gyro(config, move |t| model.error_rad_s(t0 + t))?)
            }
        });
    }
    let times_s = rows.kept().map(|k| drive.log.time.at(k)).collect::<Vec<_>>();
    let example = with_example.then(|| rows.example(&times_s, &tracks));
    let estimators = tracks.into_iter().map(|t| t.errors).collect();
    Ok(RunErrors { times_s, estimators, example })
}

/// Seconds that a step of each filter takes on this machine: three readings and a prediction, on the first run.
///
/// # Errors
/// As `run_errors`.
pub(crate) fn step_costs(setup: &Setup) -> Result<Vec<(Estimator, f64)>> {
    let options = Options { since_power_on_s: setup.since_power_on_s, ..Options::from(setup.run_seed(0)) };
    let drive = drive(&setup.truth, setup.course, setup.duration_s, &options)?;
    let rows = Rows::new(&drive, drive.log.len())?;
    let settings = Settings::default();
    let slip = SlipFilter::new(&setup.believed, &settings, setup.since_power_on_s)?.0;
    let rolling = RollingFilter::new(&setup.believed, &settings, setup.since_power_on_s)?.0;
    Ok(setup
        .estimators
        .iter()
        .filter_map(|estimator| {
            let begin = std::time::Instant::now();
            match estimator {
                Estimator::Slip => rows.filter(*estimator, slip.clone()),
                Estimator::Rolling => rows.filter(*estimator, rolling.clone()),
                Estimator::SlipUnscented => rows.filter(*estimator, UnscentedFilter::from(slip.clone())),
                _ => return None,
            };
            Some((*estimator, begin.elapsed().as_secs_f64() / rows.len() as f64))
        })
        .collect())
}

/// Whether the configuration states a spread from power-on to power-on.
fn varies(config: &Config) -> bool {
    config.gyro.as_ref().is_some_and(|g| g.turn_on_bias_std_rad_s.is_some() || g.warm_up_relative_std.is_some())
}

/// The columns of a drive that the estimators read, and its truth.
struct Rows<'a> {
    torques: [&'a [f64]; 2],
    gyro: &'a [f64],
    wheels: [&'a [f64]; 2],
    truth: [&'a [f64]; 3],
    slips: Option<[&'a [f64]; 2]>,
    step_s: f64,
    every: usize,
}

/// A filter as the study uses it.
trait PoseFilter {
    fn update(&mut self, sensor: Sensor, reading: f64) -> Option<Innovation>;
    fn predict(&mut self, input: Input, dt_s: f64);
    fn pose(&self) -> [f64; 3];
    fn pose_covariance(&self) -> Matrix3<f64>;
    fn slips(&self) -> Option<[[f64; 2]; 2]>;
}

impl<const N: usize, M: MotionModel<N>> PoseFilter for Filter<N, M> {
    fn update(&mut self, sensor: Sensor, reading: f64) -> Option<Innovation> {
        Filter::update(self, sensor, reading)
    }

    fn predict(&mut self, input: Input, dt_s: f64) {
        Filter::predict(self, input, dt_s);
    }

    fn pose(&self) -> [f64; 3] {
        let m = self.mean();
        [m[state::X], m[state::Y], m[state::HEADING]]
    }

    fn pose_covariance(&self) -> Matrix3<f64> {
        self.covariance().fixed_view::<3, 3>(state::X, state::X).into_owned()
    }

    fn slips(&self) -> Option<[[f64; 2]; 2]> {
        Filter::slips(self)
    }
}

impl<const N: usize, M: MotionModel<N>> PoseFilter for UnscentedFilter<N, M> {
    fn update(&mut self, sensor: Sensor, reading: f64) -> Option<Innovation> {
        UnscentedFilter::update(self, sensor, reading)
    }

    fn predict(&mut self, input: Input, dt_s: f64) {
        UnscentedFilter::predict(self, input, dt_s);
    }

    fn pose(&self) -> [f64; 3] {
        self.state().pose()
    }

    fn pose_covariance(&self) -> Matrix3<f64> {
        self.state().pose_covariance()
    }

    fn slips(&self) -> Option<[[f64; 2]; 2]> {
        self.state().slips()
    }
}

/// Errors, poses and slips of an estimator in a run.
struct Track {
    errors: EstimatorErrors,
    poses: Vec<[f64; 3]>,
    slips: Vec<[[f64; 2]; 2]>,
}

impl<'a> Rows<'a> {
    fn new(drive: &'a Drive, every: usize) -> Result<Self> {
        let (log, truth): (&Log, &Log) = (&drive.log, &drive.truth);
        let slips = truth.get(truth_names::SLIP_LEFT).zip(truth.get(truth_names::SLIP_RIGHT));
        Ok(Self {
            torques: [log.require(names::TORQUE_LEFT)?, log.require(names::TORQUE_RIGHT)?],
            gyro: log.require(names::GYRO_Z)?,
            wheels: [log.require(names::WHEEL_LEFT)?, log.require(names::WHEEL_RIGHT)?],
            truth: [truth.require(names::X)?, truth.require(names::Y)?, truth.require(names::HEADING)?],
            slips: slips.map(|(left, right)| [left, right]),
            step_s: log.time.median_step_s(),
            every,
        })
    }

    fn len(&self) -> usize {
        self.gyro.len()
    }

    /// Rows that are kept; the first, where every estimate is exact, is not.
    fn kept(&self) -> impl Iterator<Item = usize> + '_ {
        (self.every..self.len()).step_by(self.every)
    }

    fn error(&self, k: usize, pose: [f64; 3]) -> [f64; 3] {
        let d: [f64; 3] = std::array::from_fn(|i| pose[i] - self.truth[i][k]);
        [d[0], d[1], wrap_angle(d[2])]
    }

    fn filter(&self, estimator: Estimator, mut filter: impl PoseFilter) -> Track {
        let mut track = TrackBuilder::new(estimator, self);
        let (mut nis, mut readings, mut nees) = (0.0, 0.0, Vec::new());
        for k in 0..self.len() {
            let row = [
                (Sensor::Gyro, self.gyro[k]),
                (Sensor::WheelLeft, self.wheels[0][k]),
                (Sensor::WheelRight, self.wheels[1][k]),
            ];
            for innovation in row.into_iter().filter_map(|(sensor, reading)| filter.update(sensor, reading)) {
                nis += innovation.nis();
                readings += 1.0;
            }
            let error = track.push(k, filter.pose());
            if track.keeps(k) {
                let p = filter.pose_covariance();
                let d = Vector3::from(error);
                nees.push(p.cholesky().map_or(f64::NAN, |c| d.dot(&c.solve(&d))));
                track.slips.extend(filter.slips());
            }
            filter.predict(Input::Torques([self.torques[0][k], self.torques[1][k]]), self.step_s);
        }
        track.finish(Some(nees), Some(nis / readings))
    }

    fn reckoned(&self, estimator: Estimator, motions: impl Iterator<Item = Motion>) -> Track {
        let mut track = TrackBuilder::new(estimator, self);
        for (k, m) in motions.enumerate() {
            track.push(k, [m.x_m, m.y_m, m.heading_rad]);
        }
        track.finish(None, None)
    }

    /// Yaw rate as the gyro reads it less `error_rad_s` of the time, speed as the wheels show it; linear between rows.
    fn by_gyro(&self, config: &Config, error_rad_s: impl Fn(f64) -> f64) -> Result<impl Iterator<Item = Motion>> {
        let robot = Rolling::new(config.require_vehicle()?);
        let mut m = Motion::default();
        Ok((0..self.len()).map(move |k| {
            let [speed, _] = robot.speed_and_yaw_rate([self.wheels[0][k], self.wheels[1][k]]);
            let yaw_rate = self.gyro[k] - error_rad_s(k as f64 * self.step_s);
            if k == 0 {
                (m.speed_m_s, m.yaw_rate_rad_s) = (speed, yaw_rate);
                return m;
            }
            let forcing = Forcing {
                acceleration_m_s2: (speed - m.speed_m_s) / self.step_s,
                yaw_acceleration_rad_s2: (yaw_rate - m.yaw_rate_rad_s) / self.step_s,
                ..Forcing::default()
            };
            m = advance(&m, &forcing, self.step_s);
            m
        }))
    }

    /// Mean of the gyro over the first second: every course begins at rest.
    fn gyro_at_rest(&self) -> f64 {
        let rows = ((1.0 / self.step_s).round() as usize).clamp(1, self.len());
        self.gyro[..rows].iter().sum::<f64>() / rows as f64
    }

    fn example(&self, times_s: &[f64], tracks: &[Track]) -> Example {
        Example {
            times_s: times_s.to_vec(),
            truth: self.kept().map(|k| self.truth.map(|c| c[k])).collect(),
            estimates: tracks.iter().map(|t| (t.errors.estimator, t.poses.clone())).collect(),
            true_slips: self.slips.map_or_else(Vec::new, |s| self.kept().map(|k| s.map(|c| c[k])).collect()),
            slips: tracks
                .iter()
                .find(|t| t.errors.estimator == Estimator::Slip)
                .map_or_else(Vec::new, |t| t.slips.clone()),
        }
    }
}

/// Gathers errors row by row.
struct TrackBuilder<'a> {
    rows: &'a Rows<'a>,
    estimator: Estimator,
    squares: [f64; 3],
    count: f64,
    errors: Vec<[f64; 3]>,
    poses: Vec<[f64; 3]>,
    slips: Vec<[[f64; 2]; 2]>,
}

impl<'a> TrackBuilder<'a> {
    fn new(estimator: Estimator, rows: &'a Rows<'a>) -> Self {
        let (squares, count) = ([0.0; 3], 0.0);
        Self { rows, estimator, squares, count, errors: Vec::new(), poses: Vec::new(), slips: Vec::new() }
    }

    fn keeps(&self, k: usize) -> bool {
        k > 0 && k.is_multiple_of(self.rows.every)
    }

    fn push(&mut self, k: usize, pose: [f64; 3]) -> [f64; 3] {
        let error = self.rows.error(k, pose);
        for (sum, e) in self.squares.iter_mut().zip(error) {
            *sum += e * e;
        }
        self.count += 1.0;
        if self.keeps(k) {
            self.errors.push(error);
            self.poses.push(pose);
        }
        error
    }

    fn finish(self, nees: Option<Vec<f64>>, nis: Option<f64>) -> Track {
        let mean_squares = self.squares.map(|s| s / self.count);
        let errors = EstimatorErrors { estimator: self.estimator, mean_squares, errors: self.errors, nees, nis };
        Track { errors, poses: self.poses, slips: self.slips }
    }
}
