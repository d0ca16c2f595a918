//! reading = output( filter( rate + e(t) + Σ bias_i + scale · white ) ), each of the four changed by any set of effects
//!
//! Floor 2: what an effect may change in the simulator of a gyro. The simulator runs whatever implements [`GyroEffect`];
//! it knows no effect by name. What an effect may change of a robot that drives is in [`drive`].

pub mod drive;
mod in_filter;
mod instrument;
mod moving;
mod past;

pub use in_filter::{GyroInFilter, InFilter, Switch, Way};

use crate::bias::WarmUp;
use crate::signal::TimeAxis;

/// The conditions of one recording: its rows, the covariates that were measured beside the rate, and the nominal model.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Rows, s since power-on.
    pub time: TimeAxis,
    /// Sample time, s.
    pub step_s: f64,
    /// Temperature, °C, one value a row, without gaps; none where it was not logged.
    pub temperature_c: Option<Vec<f64>>,
    /// Temperature at power-on, °C; none where it is that of the first second.
    pub power_on_temperature_c: Option<f64>,
    /// Supply, V, one value a row, without gaps; none where it was not logged.
    pub supply_v: Option<Vec<f64>>,
    /// Nominal warm-up.
    pub warm_up: WarmUp,
    /// Nominal standard deviation of a sample's white noise, rad/s.
    pub white_std_rad_s: f64,
    /// Standard deviation of C2 from one power-on to the next, rad/s.
    pub turn_on_bias_std_rad_s: f64,
    /// Relative standard deviation of C1 and T from one power-on to the next.
    pub warm_up_relative_std: f64,
}

impl Scene {
    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// Whether there are no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Temperature at power-on, °C; else the mean of the first second; `None` without a temperature.
    #[must_use]
    pub(crate) fn first_temperature_c(&self) -> Option<f64> {
        let values = self.temperature_c.as_ref().filter(|t| !t.is_empty())?;
        let rows = ((1.0 / self.step_s).round().max(1.0) as usize).min(values.len());
        self.power_on_temperature_c.or_else(|| Some(values[..rows].iter().sum::<f64>() / rows as f64))
    }

    /// Length of the recording, s.
    #[must_use]
    pub fn span_s(&self) -> f64 {
        self.step_s * self.len() as f64
    }
}

/// An effect at work in one simulated recording. The simulator calls the four in this order for every row, rows ascending.
pub trait GyroEffect: Send {
    /// Added to the bias at row `row`, rad/s.
    fn bias_rad_s(&mut self, row: usize, scene: &Scene) -> f64 {
        let _ = (row, scene);
        0.0
    }

    /// Factor on the standard deviation of the white noise at row `row`.
    fn white_scale(&mut self, row: usize, scene: &Scene) -> f64 {
        let _ = (row, scene);
        1.0
    }

    /// Output of a filter inside the sensor for the input `rate_rad_s`, rad/s.
    fn filtered(&mut self, rate_rad_s: f64) -> f64 {
        rate_rad_s
    }

    /// Output of the sensor, rad/s; without the effect it is `reading_rad_s`.
    fn output(&mut self, row: usize, reading_rad_s: f64) -> f64 {
        let _ = row;
        reading_rad_s
    }

    /// Form of the effect in a filter.
    fn in_filter(&self) -> GyroInFilter {
        GyroInFilter::Unrepresented("what it does to the readings only a simulator knows")
    }
}

/// Inputs of a filter through which an effect of drives acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Through {
    /// The torques.
    pub torques: bool,
    /// The gyro's reading.
    pub gyro: bool,
}

/// Makes effects from the tables `[[effect]]` of a configuration. The caller of a simulator passes one in, so that the
/// simulator need not know the library of effects.
pub trait EffectSource: Sync {
    /// The effect `id` with `parameters` in a recording of `scene`, its random numbers from `seed`.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Config`] if the id or a parameter is unknown, missing or out of bounds, or the scene lacks the
    /// covariate that it needs.
    fn gyro_effect(
        &self,
        id: &str,
        parameters: &std::collections::BTreeMap<String, f64>,
        scene: &Scene,
        seed: u64,
    ) -> crate::Result<Box<dyn GyroEffect>>;

    /// Whether [`EffectSource::drive_effect`] knows the effect `id`; in drives it is then made there, also where
    /// [`EffectSource::gyro_effect`] knows it too.
    fn is_of_drives(&self, id: &str) -> bool;

    /// Inputs of a filter, torques and gyro, that the drive effect `id` acts through. A filter without them is not
    /// changed by it.
    fn acts_through(&self, id: &str) -> Through {
        let _ = id;
        Through::default()
    }

    /// The effect `id` with `parameters` in a drive of `span_s` seconds, its random numbers from `seed`.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Config`] if the id or a parameter is unknown, missing or out of bounds.
    fn drive_effect(
        &self,
        id: &str,
        parameters: &std::collections::BTreeMap<String, f64>,
        span_s: f64,
        seed: u64,
    ) -> crate::Result<Box<dyn drive::DriveEffect>>;
}
