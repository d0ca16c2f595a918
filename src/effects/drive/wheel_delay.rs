//! reading_i(t) = wheel_i(t - τ) of both wheels

use super::change::{Constant, Law, TIMED_ROWS};
use super::contract::Touches;
use super::on_log::OnLog;
#[cfg(test)]
use super::tried::Tried;
use crate::effects::about::{About, Parameter};
use crate::model::InFilter;
use crate::model::drive::{DriveEffect, Instrument};

/// Wheels that are stamped late.
pub(super) struct WheelDelay;

impl Law for WheelDelay {
    const ITSELF: &'static Self = &WheelDelay;
    const ON_LOG: Option<OnLog> = Some(OnLog::late(Instrument::Wheels));
    #[cfg(test)]
    const TRIED: Tried = Tried::wheels(&[("delay_s", 0.03)]);
    const ABOUT: &'static About = &About {
        id: "sensor.wheel_delay",
        title: "late wheels",
        equation: "reading_i(t) = wheel_i(t - τ) of both wheels",
        source: "Furgale et al., Unified temporal and spatial calibration for multi-sensor systems (2013)",
        channel: "wheels",
        deficient: "wheel measurement: it is stamped late against everything else",
        condition: Some("acceleration"),
        parameters: &[Parameter {
            name: "delay_s",
            meaning: "τ, s",
            bounds: [0.0, 0.4],
            null: Some(0.0),
            required: true,
        }],
        remedy: "Stamp the counts where they are taken, or shift the wheels by the delay.",
    };
}

impl Constant for WheelDelay {
    const SCALE: [f64; 2] = [1e-3, 0.05];
    const IS_POSITIVE: bool = true;
    const LAGS: Option<Instrument> = Some(Instrument::Wheels);
    const USUAL_ROWS: f64 = TIMED_ROWS;
    const SIZES: &'static str = "Furgale et al. (2013): some milliseconds on a bus, some tens where messages queue";
    const TOUCHES: Touches = Touches::WHEELS;

    fn off_by(value: f64) -> Box<dyn DriveEffect> {
        Box::new(Work(value))
    }
}

struct Work(f64);

impl DriveEffect for Work {
    fn delay_s(&self, instrument: Instrument) -> f64 {
        if instrument == Instrument::Wheels { self.0 } else { 0.0 }
    }

    fn in_filter(&self) -> InFilter {
        InFilter::WheelDelay(self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Driving, by_id, ids};
    use crate::model::drive::{DriveModel, Moving, Past, Robot};

    #[test]
    fn late_wheels_tell_speeds_and_slip_of_the_instant_they_were_read() {
        let by_id = |id| by_id(id).and_then(Driving::change).unwrap();
        let slip = || by_id(ids::slip()).at(&[0.3, 0.0]);
        let late = by_id(ids::wheel_delay()).at(&[0.025]);
        let mut past = Past::default();
        let then = |k: f64| ([0.4 + 0.1 * k, -0.3 * k], [2.0 + k, -1.0 - k]);
        for k in 0..4 {
            let (rates, forces) = then(f64::from(k));
            past.push(0.01 * f64::from(k), rates, forces);
        }
        let now = |k: f64, past| {
            let ([speed_m_s, yaw_rate_rad_s], wheel_force_n) = then(k);
            Moving { t_s: 0.01 * k, speed_m_s, yaw_rate_rad_s, wheel_force_n, past, ..Moving::default() }
        };
        // rates between those of 10 and 20 ms, the force of the step that ends at 20 ms
        let read = Moving { wheel_force_n: then(2.0).1, ..now(1.5, None) };
        let rolling = DriveModel::new(Robot::small(), vec![slip()]).wheels_rad_s(&read);
        let model = DriveModel::new(Robot::small(), vec![late, slip()]);
        let wheels = model.wheels_rad_s(&now(4.0, Some(&past)));
        assert!((0..2).all(|i| (wheels[i] - rolling[i]).abs() < 1e-12), "{wheels:?} {rolling:?}");
        // between two steps: the one that ended there
        let model = DriveModel::new(Robot::small(), vec![by_id(ids::wheel_delay()).at(&[0.02]), slip()]);
        let rolling = DriveModel::new(Robot::small(), vec![slip()]).wheels_rad_s(&now(2.0, None));
        let wheels = model.wheels_rad_s(&now(4.0, Some(&past)));
        assert!((0..2).all(|i| (wheels[i] - rolling[i]).abs() < 1e-12), "{wheels:?} {rolling:?}");
    }
}
