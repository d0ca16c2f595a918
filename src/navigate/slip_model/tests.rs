use super::*;
use crate::config::Config;
use crate::math::distributions::chi_squared_interval95;
use crate::navigate::{RollingFilter, Sensor, Settings, SlipFilter, WheelModel, names, run};
use crate::signal::names as channels;
use crate::simulate::{Course, Options, drive, truth_names};
use crate::traction::{Surface, TractionLaw};

fn config(surface: Surface) -> Config {
    let mut config = Config::parse(include_str!("../../../data/study.toml"), "study.toml").unwrap();
    config.traction = Some(Traction::new(TractionLaw::Burckhardt(surface.law())));
    config
}

fn model(surface: Surface) -> SlipModel {
    let c = config(surface);
    SlipModel::new(c.require_vehicle().unwrap(), c.require_traction().unwrap())
}

fn moving() -> SVector<f64, N> {
    let (v, w, r, b) = (0.5, -0.4, 0.05, 0.17);
    SVector::from([0.4, -1.0, 0.9, v, w, 7e-3, 5e-3, 5.48, (v - b * w) / r * 1.004, (v + b * w) / r * 1.006])
}

#[test]
fn derivatives_are_those_of_differences() {
    for surface in Surface::ALL {
        let m = model(surface);
        let mean = moving();
        for input in [Input::Torques([0.06, 0.05]), Input::Accelerations([0.1, 0.2])] {
            let mut out = Transition::rest(&mean);
            m.carry(&mean, None, input, 0.01, &mut out);
            let difference = |change: &dyn Fn(f64) -> SVector<f64, N>| (change(1e-6) - change(-1e-6)) / 2e-6;
            for column in MOVED {
                // what the torques are where none are known is an input, not a state
                let torques = Input::Torques(m.torques(&mean, input));
                let by = difference(&|eps| {
                    let mut x = mean;
                    x[column] += eps;
                    m.disturbed(&x, torques, [0.0; 2], 0.01)
                });
                let error = (by - out.phi.column(column)).amax();
                // curvature of slip times eps², Newton's tolerance over eps
                assert!(error < 2e-5 * out.phi.column(column).amax().max(1.0), "{} {column}: {error}", surface.name());
            }
            for k in 0..2 {
                let by = difference(&|eps| {
                    let mut size = [0.0; 2];
                    size[k] = eps;
                    m.disturbed(&mean, input, size, 0.01)
                });
                assert!((by - out.gamma.column(k)).amax() < 2e-5 * out.gamma.column(k).amax().max(1.0));
            }
        }
    }
}

#[test]
fn over_a_small_spread_the_bent_step_is_its_derivative() {
    let m = model(Surface::Ice);
    let mean = moving();
    let input = Input::Torques([0.1, 0.12]);
    let mut flat = Transition::rest(&mean);
    m.carry(&mean, None, input, 0.01, &mut flat);
    // each state known to 1e-6: the law of ice bends over slips of 1/306
    let tight = UdCovariance::factor(&(SMatrix::<f64, N, N>::identity() * 1e-12)).unwrap();
    let mut over = Transition::rest(&mean);
    m.carry(&mean, Some(&tight), input, 0.01, &mut over);
    let bend = over.bend.expect("ice is bent here");
    for i in MOVED {
        for k in CAUSES {
            let scale = flat.phi.column(k).amax().max(1.0);
            assert!((flat.phi[(i, k)] - over.phi[(i, k)]).abs() < 1e-3 * scale, "{i} {k}");
        }
    }
    assert!(bend.columns(0, 4).amax() < 1e-9, "{}", bend.columns(0, 4).amax());
    // where the wheels grip nothing is bent
    let gripping = model(Surface::DryAsphalt);
    let mut rolling = mean;
    (rolling[WHEELS], rolling[WHEELS + 1]) = ((0.5 + 0.17 * 0.4) / 0.05, (0.5 - 0.17 * 0.4) / 0.05);
    let mut out = Transition::rest(&rolling);
    gripping.carry(&rolling, Some(&tight), Input::Torques([0.02, 0.02]), 0.01, &mut out);
    assert!(out.bend.is_none());
}

#[test]
fn at_the_start_the_wheels_are_taken_to_roll() {
    let c = config(Surface::Snow);
    let slip = SlipFilter::new(&c, &Settings::default(), 20.0).unwrap().0;
    let rolling = RollingFilter::new(&c, &Settings::default(), 20.0).unwrap().0;
    let p = slip.covariance();
    for side in 0..2 {
        let row = rolling_row(&Rolling::new(&c.vehicle.unwrap()), side);
        let expected = (row.transpose() * p * row)[0] + ROLLING_STD_RAD_S * ROLLING_STD_RAD_S;
        assert!((p[(WHEELS + side, WHEELS + side)] / expected - 1.0).abs() < 1e-12);
        // a reading of a wheel is as likely in both filters, up to that standard deviation
        let sensor = [Sensor::WheelLeft, Sensor::WheelRight][side];
        let (mut a, mut b) = (slip.clone(), rolling.clone());
        let (a, b) = (a.update(sensor, 1.0).unwrap(), b.update(sensor, 1.0).unwrap());
        assert!((a.variance / b.variance - 1.0).abs() < 1e-6 && a.residual == b.residual);
    }
}

#[test]
fn slips_are_as_uncertain_as_they_say() {
    // the last row of many short drives, on which the wheels slide, grip or stand
    let c = config(Surface::Snow);
    let runs = 80;
    let mut squares = [0.0; 2];
    let mut sliding = 0;
    for seed in 0..runs {
        let d = drive(&c, Course::Brisk, 4.0, &Options { vary_turn_on: true, ..Options::from(seed) }).unwrap();
        let out = run(&c, &d.log, &Settings::default()).unwrap();
        assert!(out.summary.slip_modelled);
        let last = |log: &crate::signal::Log, name: &str| *log.get(name).unwrap().last().unwrap();
        for (side, (slip, std, truth)) in [
            (names::SLIP_LEFT, names::SLIP_LEFT_STD, truth_names::SLIP_LEFT),
            (names::SLIP_RIGHT, names::SLIP_RIGHT_STD, truth_names::SLIP_RIGHT),
        ]
        .into_iter()
        .enumerate()
        {
            let truth = last(&d.truth, truth);
            squares[side] += ((last(&out.pose, slip) - truth) / last(&out.pose, std)).powi(2);
            sliding += usize::from(truth.abs() > 0.05);
        }
    }
    assert!(sliding > 10, "{sliding}");
    let [low, high] = chi_squared_interval95(runs as f64);
    for square in squares {
        // twice the width of the 95 % interval: near standstill slip is no normal deviate
        let (middle, half) = (0.5 * (low + high), high - low);
        assert!((square - middle).abs() < half, "{square}: {low} .. {high}");
    }
}

#[test]
fn without_torques_the_robot_rolls_unless_slip_is_asked_for() {
    let c = config(Surface::Snow);
    let mut log = drive(&c, Course::Square, 5.0, &Options::from(3)).unwrap().log;
    log.channels.retain(|c| c.name != channels::TORQUE_LEFT && c.name != channels::TORQUE_RIGHT);
    let auto = run(&c, &log, &Settings::default()).unwrap();
    assert!(!auto.summary.slip_modelled && auto.summary.notes.iter().any(|n| n.contains("[traction]")));
    assert!(auto.pose.get(names::SLIP_LEFT).is_none());
    let slips = run(&c, &log, &Settings { wheels: WheelModel::Slip, ..Settings::default() }).unwrap();
    assert!(slips.summary.slip_modelled && slips.pose.get(names::SLIP_LEFT_STD).is_some());
    let mut plain = c;
    plain.traction = None;
    let error = run(&plain, &log, &Settings { wheels: WheelModel::Slip, ..Settings::default() }).unwrap_err();
    assert!(error.to_string().contains("[traction]"));
}

#[test]
fn gyro_and_encoders_observe_all_but_the_pose() {
    // information without process noise, Σ Φᵀ hᵀ h Φ/R, in units of the prior: its null space is x, y and θ
    let c = config(Surface::Snow);
    let d = drive(&c, Course::Brisk, 60.0, &Options { since_power_on_s: 5.0, ..Options::from(4) }).unwrap();
    let column = |name: &str| d.log.get(name).unwrap();
    let m = model(Surface::Snow);
    let mut filter = SlipFilter::new(&c, &Settings::default(), 5.0).unwrap().0;
    let prior = filter.std();
    let mut through = SMatrix::<f64, N, N>::identity();
    let mut information = SMatrix::<f64, N, N>::zeros();
    let mut gyro = SVector::<f64, N>::zeros();
    (gyro[YAW_RATE], gyro[state::GYRO_ERROR]) = (1.0, 1.0);
    let noise = [1.5e-4f64.powi(2) / 0.01, 0.02f64.powi(2), 0.02f64.powi(2)];
    let decay = (-0.01f64 / 240.0).exp();
    for k in 0..d.log.len() {
        for (row, r) in [gyro, m.wheel_row(0), m.wheel_row(1)].into_iter().zip(noise) {
            let h = (row.transpose() * through).transpose();
            let h = h.component_mul(&prior);
            information += h * h.transpose() / r;
        }
        let input = Input::Torques([column(channels::TORQUE_LEFT)[k], column(channels::TORQUE_RIGHT)[k]]);
        let mut out = Transition::rest(filter.mean());
        m.carry(filter.mean(), None, input, 0.01, &mut out);
        let (e, s) = (filter.mean()[state::GYRO_ERROR], filter.mean()[state::WARM_ERROR]);
        out.phi[(state::GYRO_ERROR, state::GYRO_ERROR)] = decay;
        out.phi[(state::GYRO_ERROR, state::WARM_ERROR)] = 1.0 - decay;
        out.phi[(state::GYRO_ERROR, state::LN_TIME_CONSTANT)] = -(s - e) * decay * 0.01 / 240.0;
        through = out.phi * through;
        for (sensor, name) in [
            (Sensor::Gyro, channels::GYRO_Z),
            (Sensor::WheelLeft, channels::WHEEL_LEFT),
            (Sensor::WheelRight, channels::WHEEL_RIGHT),
        ] {
            filter.update(sensor, column(name)[k]);
        }
        filter.predict(input, 0.01);
    }
    for i in [X, Y, HEADING] {
        assert_eq!(information.column(i).amax(), 0.0, "state {i} is observed");
    }
    let rest = information.fixed_view::<7, 7>(3, 3).into_owned();
    // all the others are: every direction gains on its prior, but for the asymptote and T within a minute
    let values = rest.symmetric_eigenvalues();
    assert!(values.min() > 0.0, "{values}");
    for i in [SPEED, YAW_RATE, state::GYRO_ERROR, WHEELS, WHEELS + 1] {
        assert!(information[(i, i)] > 1.0, "state {i}: {}", information[(i, i)]);
    }
}
