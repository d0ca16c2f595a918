//! The setup of a study: its estimators of the pose, its robot and drive, its seeds.

use crate::config::{Config, Traction};
use crate::simulate::Course;
use crate::traction::{Surface, TractionLaw};

/// An estimator of the pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) enum Estimator {
    /// The filter with slip.
    Slip,
    /// The filter without slip.
    Rolling,
    /// The filter with slip that takes the gyro for free of error.
    SlipWithoutErrorModel,
    /// The filter without slip that takes the gyro for free of error.
    RollingWithoutErrorModel,
    /// Encoders alone.
    DeadReckoning,
    /// Heading from the gyro as it reads, speed from the encoders.
    GyroReckoning,
    /// The same, less the gyro's mean over the first second, in which the robot stands.
    GyroReckoningZeroed,
    /// The same, less the error model with its nominal parameters.
    GyroReckoningModelled,
    /// The filter with slip on sigma points: a check of the linearisation.
    SlipUnscented,
}

impl Estimator {
    /// All of them.
    pub(crate) const ALL: [Self; 9] = [
        Self::Slip,
        Self::Rolling,
        Self::SlipWithoutErrorModel,
        Self::RollingWithoutErrorModel,
        Self::DeadReckoning,
        Self::GyroReckoning,
        Self::GyroReckoningZeroed,
        Self::GyroReckoningModelled,
        Self::SlipUnscented,
    ];

    /// The two filters of the paper.
    pub(crate) const FILTERS: [Self; 2] = [Self::Slip, Self::Rolling];

    /// Its name in JSON.
    #[must_use]
    pub(crate) fn id(self) -> &'static str {
        match self {
            Self::Slip => "slip",
            Self::Rolling => "rolling",
            Self::SlipWithoutErrorModel => "slip_without_error_model",
            Self::RollingWithoutErrorModel => "rolling_without_error_model",
            Self::DeadReckoning => "dead_reckoning",
            Self::GyroReckoning => "gyro_reckoning",
            Self::GyroReckoningZeroed => "gyro_reckoning_zeroed",
            Self::GyroReckoningModelled => "gyro_reckoning_modelled",
            Self::SlipUnscented => "slip_unscented",
        }
    }

    /// The estimator of this name.
    #[must_use]
    pub(crate) fn parse(id: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|e| e.id() == id)
    }

    /// Its name in words.
    #[must_use]
    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Slip => "filter with slip",
            Self::Rolling => "filter without slip",
            Self::SlipWithoutErrorModel => "with slip, without gyro error model",
            Self::RollingWithoutErrorModel => "without slip, without gyro error model",
            Self::DeadReckoning => "encoders alone",
            Self::GyroReckoning => "raw gyro and encoders, no filter",
            Self::GyroReckoningZeroed => "the same, gyro zeroed at the start",
            Self::GyroReckoningModelled => "the same, gyro less the error model",
            Self::SlipUnscented => "filter with slip on sigma points",
        }
    }
}

/// Quantities whose errors are kept: x, y (m) and heading (rad).
pub(crate) const QUANTITIES: [&str; 3] = ["x_m", "y_m", "heading_rad"];

/// Setup of a study.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Setup {
    /// Robot and gyro of reality; must have `[traction]`.
    pub truth: Config,
    /// Configuration of the filters; that of the truth except in studies of sensitivity.
    pub believed: Config,
    /// The drive.
    pub course: Course,
    /// Its length, s.
    pub duration_s: f64,
    /// Time since power-on when it begins, s.
    pub since_power_on_s: f64,
    /// Number of runs.
    pub runs: usize,
    /// Seed of the first run; the others follow.
    pub seed: u64,
    /// Estimators of the pose.
    pub estimators: Vec<Estimator>,
}

impl Setup {
    /// 100 runs of 60 s, from 20 s after power-on, with all estimators.
    #[must_use]
    pub(crate) fn new(config: Config, course: Course) -> Self {
        Self {
            believed: config.clone(),
            truth: config,
            course,
            duration_s: 60.0,
            since_power_on_s: 20.0,
            runs: 100,
            seed: 1,
            estimators: Estimator::ALL.to_vec(),
        }
    }

    /// The same on another ground, known to the filter.
    #[must_use]
    pub(crate) fn on(&self, surface: Surface) -> Self {
        let law = TractionLaw::Burckhardt(surface.law());
        let mut out = self.clone();
        for config in [&mut out.truth, &mut out.believed] {
            config.traction = Some(config.traction.map_or_else(|| Traction::new(law), |t| Traction { law, ..t }));
        }
        out
    }

    /// The seed of run `index`.
    #[must_use]
    pub(crate) fn run_seed(&self, index: usize) -> u64 {
        // runs of neighbouring seeds must have nothing in common: splitmix64's step, as in `Stream`
        let mut z = self.seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(index as u64);
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }
}
