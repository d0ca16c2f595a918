//! q = Σ κ_k²/dt_k:   diffusion of v and ω by an input of which nothing is known
//!
//! Without torques nothing tells why a robot moves as it does. Whoever drives does the same at every corner, and a control
//! answers what the robot does, so that the changes κ of v or ω from row to row are no noise: they follow the state. Where
//! the motion before a row predicts it, functions of the state explain them, and pass for errors of an instrument. N
//! changes that are alike tell Σκ²/2S nats of such a function, S the variance of the innovation: half of one where S is
//! the sum of all. What the readings of one row tell of each other does not depend on S.
//!
//! But delays within a row, bursts of lost ticks and noise that is averaged are told by the motion alone. So a drive is
//! judged with this diffusion only where the motion asks for a free form. That takes instruments that are read
//! in the same rows, and often: derivatives are those at the prediction.

use crate::gap::drive::ekf::agility::{Source, sources};
use crate::gap::drive::ekf::noise::Noise;
use crate::gap::drive::record::{Belief, Record};

/// Mean square of a change from row to row over that of the readings. Two neighbours then have a correlation of 0.99, and
/// a derivative at the row before is wrong by as little.
const MOST_CHANGE: f64 = 0.02;
/// Share of the rows in which wheels and gyro both must be read.
const TOGETHER: f64 = 0.9;

/// `record` with its motion as an unknown input; none where that has to tell one reading of another.
pub(crate) fn assumed(record: &Record) -> Option<Record> {
    let unknown_input = diffusion(record)?;
    let belief = Belief { unknown_input, ..record.belief };
    Some(Record { belief, ..record.clone() })
}

/// Diffusions of v (m²/s³) and ω (rad²/s³) by it.
fn diffusion(record: &Record) -> Option<[f64; 2]> {
    if record.torques_n_m.is_some() || !are_read_together(record) {
        return None;
    }
    // squares of the changes, the same over time, squares of the readings
    let mut sums = [[0.0; 3]; 2];
    for rows in record.drives() {
        for (sums, sources) in sums.iter_mut().zip(sources(record, &rows)) {
            let Source { rows, values, .. } = sources.first()?;
            for (two, k) in values.windows(2).zip(rows.windows(2)) {
                let change = (two[1] - two[0]).powi(2);
                let over_s = record.times_s[k[1]] - record.times_s[k[0]];
                sums.iter_mut().zip([change, change / over_s, two[1] * two[1]]).for_each(|(sum, own)| *sum += own);
            }
        }
    }
    let often = sums.iter().all(|[changes, _, readings]| *changes <= MOST_CHANGE * readings);
    often.then(|| sums.map(|[_, diffusion, _]| diffusion))
}

/// Whether most rows with a reading of wheels or gyro have both; wheels alone are.
fn are_read_together(record: &Record) -> bool {
    let Some(gyro) = &record.gyro_rad_s else { return true };
    let (mut both, mut any) = (0, 0);
    for (k, gyro) in gyro.iter().enumerate() {
        let there = [gyro.is_finite(), record.rolling(k)[1].is_finite()];
        both += usize::from(there == [true; 2]);
        any += usize::from(there != [false; 2]);
    }
    both as f64 >= TOGETHER * any as f64
}

/// √(h'R⁻¹h) of v and of ω over that of the nominal robot, h the derivatives of the readings of one row: the input is as
/// unknown in the unit of the readings, whatever scales them. Else a smaller scale of all speeds would gain a nat a row.
/// `by_speed`, `by_yaw_rate`: derivatives of left wheel, right wheel and gyro by v (rad/m) and ω.
pub(super) fn steepness(record: &Record, noise: &Noise, by_speed: [f64; 3], by_yaw_rate: [f64; 3]) -> [f64; 2] {
    let robot = &record.belief.robot;
    let gyro = f64::from(u8::from(record.gyro_rad_s.is_some()));
    let told = |h: [f64; 3]| h.iter().zip(&noise.reading).map(|(h, variance)| h * h / variance).sum::<f64>();
    let of = |h: [f64; 3], nominal: [f64; 3]| (told([h[0], h[1], gyro * h[2]]) / told(nominal)).sqrt();
    let fast = robot.radius_m.map(f64::recip);
    let turn = fast.map(|by| robot.half_track_m * by);
    [of(by_speed, [fast[0], fast[1], 0.0]), of(by_yaw_rate, [turn[0], turn[1], gyro])]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::effects::Library;
    use crate::effects::drive::{Driving, registry};
    use crate::gap::drive::ekf::innovations::run;
    use crate::gap::drive::ekf::models::Models;
    use crate::gap::drive::ekf::noise::Process;
    use crate::gap::drive::model_selection::judge;
    use crate::gap::drive::options::Options;
    use crate::gap::drive::preprocess::clocks::tests::without;
    use crate::gap::selection::sets::Main;
    use crate::model::drive::DriveModel;
    use crate::signal::names;
    use crate::simulate::{Course, Options as Simulated, drive_with};

    /// A robot whose control takes back a disturbance within a tenth of a second.
    const ROBOT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.02\n\
        [gyro]\nc1_rad_s = 0.0\nc2_rad_s = 1e-3\ntime_constant_s = 200.0\nangle_random_walk_rad_sqrt_s = 1.5e-4\n\
        [vehicle]\nmass_kg = 14.0\nyaw_inertia_kg_m2 = 0.4\nhalf_track_m = 0.2\nwheel_radius_m = 0.07\n\
        wheel_inertia_kg_m2 = 1e-3\nviscous_friction_n_m_s = 0.002\ntorque_noise_n_m_sqrt_s = 1e-3\n\
        [encoder]\nspeed_noise_std_rad_s = 0.02\n[pose]\nrate_hz = 50.0\nposition_std_m = 0.005\nheading_std_rad = 0.005\n";
    const TORQUES: [&str; 2] = [names::TORQUE_LEFT, names::TORQUE_RIGHT];
    const POSE: [&str; 3] = [names::X, names::Y, names::HEADING];

    fn scale_factor() -> &'static dyn Driving {
        *registry().iter().find(|e| e.about().title == "gyro scale factor").unwrap()
    }

    /// A drive around squares, simulated with `effect`, without torques and the channels `lost`.
    fn squares(duration_s: f64, effect: &str, lost: &[&str]) -> Record {
        let [nominal, real] = ["", effect].map(|more| Config::parse(&format!("{ROBOT}{more}"), "robot.toml").unwrap());
        let log = drive_with(&real, Course::Square, duration_s, &Simulated::from(5), &Library::new()).unwrap().log;
        Record::new(&nominal, &without(log, &[&TORQUES[..], lost].concat()), 0.0).unwrap()
    }

    /// Without the diffusion 20 nats spoke for an error of the gyro that follows the turning.
    #[test]
    fn squares_without_torques_lack_nothing() {
        let findings = judge(&squares(120.0, "", &POSE), registry(), &Options::default()).findings;
        assert_eq!(findings.mains()[0].0, Main::None, "{:?}", findings.mains());
    }

    /// Without the diffusion each had an error of gyro and wheels that follows the yaw rate, of 40 to 300 nats.
    #[test]
    #[ignore = "battery: four drives of four minutes"]
    fn battery_of_squares_without_torques() {
        let mains = |effect: &str, lost: &[&str]| {
            let findings = judge(&squares(240.0, effect, lost), registry(), &Options::default()).findings;
            findings.mains()[0].0.clone()
        };
        assert_eq!(mains("", &POSE), Main::None);
        assert_eq!(mains("", &[]), Main::None);
        // a square turns one way: which of the gyro's gains it is, or without a pose whether the wheels', it cannot tell
        let gain = format!("[[effect]]\nid = \"{}\"\nrelative = 0.004\n", scale_factor().about().id);
        for lost in [&POSE[..], &[]] {
            assert!(matches!(mains(&gain, lost), Main::Effect(_)), "without {lost:?}: {:?}", mains(&gain, lost));
        }
    }

    #[test]
    fn only_instruments_that_are_read_together_and_often_need_no_motion_between() {
        let record = squares(20.0, "", &POSE);
        let [v, w] = diffusion(&record).unwrap();
        assert!(v > 0.0 && w > 0.0);
        let mut apart = record.clone();
        for (k, gyro) in apart.gyro_rad_s.iter_mut().flatten().enumerate() {
            *gyro = if k % 5 == 0 { *gyro } else { f64::NAN };
        }
        assert!(assumed(&apart).is_none());
        let every = |values: &[f64]| values.iter().step_by(20).copied().collect::<Vec<f64>>();
        let seldom = Record {
            times_s: every(&record.times_s),
            since_power_on_s: every(&record.since_power_on_s),
            gyro_rad_s: record.gyro_rad_s.as_deref().map(every),
            wheels_rad_s: record.wheels_rad_s.each_ref().map(|wheel| every(wheel)),
            ..record
        };
        assert!(assumed(&seldom).is_none());
    }

    /// ln 2πS is the same for a gyro of any gain, so that no gain is favoured by it.
    #[test]
    fn the_volume_does_not_depend_on_the_scale_of_the_readings() {
        let record = squares(20.0, "", &POSE);
        let believed = Noise::believed(&record, None);
        let process = Process { unknown_input: diffusion(&record).unwrap(), ..believed.process };
        let noise = Noise { process, ..believed };
        let gain = scale_factor().change().unwrap();
        let volume = |relative: f64| {
            let model = DriveModel::new(record.belief.robot, vec![gain.at(&[relative])]);
            let models = Models::alone(model, Vec::new());
            run(&record, &models, &noise, &[], |_| {}).ln_volume
        };
        // a hundredth of what it is with a diffusion of the yaw rate itself: 2 ln(1 + gain) a row
        let by = (volume(0.05) - volume(0.0)).abs();
        assert!(by < 0.01 * 2.0 * 0.05 * record.len() as f64, "{by}");
    }
}
