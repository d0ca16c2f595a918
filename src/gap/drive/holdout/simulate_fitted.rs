//! Recordings of a simulated model with effects: same torques, rows and channels as a given recording, with noise of
//! their own.

use crate::effects::drive::Lost;
use crate::gap::drive::ekf::effect_set::EffectSet;
use crate::gap::drive::ekf::filter_pass::{FilterPass, RowLinearization};
use crate::gap::drive::ekf::noise::Process;
use crate::gap::drive::ekf::slopes::Slopes;
use crate::gap::drive::record::Record;
use crate::gap::drive::record::reckoning::FirstPose;
use crate::gap::drive::regressors::basis::Scales;
use crate::math::random::Stream;
use crate::model::drive::{Instrument, Moving, Past};

/// First random stream of the floor's recordings.
const STREAM: u64 = 0xD12;

/// Speed (m/s) and yaw rate (rad/s) in every row, as estimated by the filter of this model, with the diffusion of `process`.
fn filtered(like: &Record, claimed: &EffectSet, process: Process) -> Vec<[f64; 2]> {
    let (record, models) = claimed.read(like);
    let (noise, scales) = (claimed.noise(&record, process), Scales::of(&record, &process.agility));
    let mut along = FilterPass::new(&record, 0..record.len(), &scales, &models, &noise, &[]);
    let mut row = RowLinearization::default();
    let mut speeds = Vec::with_capacity(record.len());
    while along.row(&mut row) {
        speeds.push(row.speeds);
    }
    speeds
}

/// A simulated recording; quantities that differ from run to run are drawn for each drive. `process`: motion beyond the
/// model.
#[must_use]
pub(crate) fn own(like: &Record, claimed: &EffectSet, process: Process, seed: u64) -> Record {
    like.by_drive(|drive, like| {
        own_drive(like, claimed, process, &mut Stream::new(seed, STREAM + ((drive as u64) << 32)))
    })
}

fn own_drive(like: &Record, claimed: &EffectSet, process: Process, draw: &mut Stream) -> Record {
    let Process { ripple, .. } = process;
    let mut out = like.clone();
    let models = claimed.models(like);
    let model = &models.here;
    let mut believed = like.belief;
    claimed.believe(&mut believed);
    let b = &believed;
    let [c2, c1, lag] = [
        b.turn_on_bias_std_rad_s * draw.normal(),
        1.0 + b.warm_up_relative_std * draw.normal(),
        (b.warm_up_relative_std * draw.normal()).exp(),
    ];
    let mut warm_up = b.warm_up;
    warm_up.c2_rad_s += c2;
    warm_up.c1_rad_s *= c1;
    warm_up.time_constant_s *= lag;
    let step_at_s = like.span_s() * draw.uniform();
    let mut walk = 0.0;
    let mut past = Past::default();
    let pose_late_s = model.delay_s(Instrument::Pose);
    let mut been: Vec<[f64; 3]> = Vec::with_capacity(like.len());
    // motion: x, y, θ, v, ω
    let first = |values: &[f64]| values.iter().copied().find(|v| v.is_finite()).unwrap_or(0.0);
    let [v, w] = b.robot.speed_and_yaw_rate([0, 1].map(|i| first(&like.wheels_rad_s[i])));
    let pose = FirstPose::of(like, 0..like.len()).map_or([0.0; 3], |first| first.back_at(like, 0));
    let mut s = [pose[0], pose[1], pose[2], v, w];
    // without torques it follows the filtered speeds of the recording
    let driven = like.torques_n_m.is_none().then(|| filtered(like, claimed, process));
    if let Some(first) = driven.as_ref().and_then(|d| d.first()) {
        [s[3], s[4]] = *first;
    }
    let mut before = ([0.0; 2], [0.0; 2]);
    let mut slopes = Slopes::new(Scales::of(like, &process.agility).slopes_over_s);
    let mut lost = false;
    let start_s = like.times_s.first().copied().unwrap_or(0.0);
    for k in 0..like.len() {
        let t_s = like.times_s[k] - start_s;
        let at = Moving {
            t_s,
            since_power_on_s: like.since_power_on_s[k],
            x_m: s[0],
            y_m: s[1],
            heading_rad: s[2],
            speed_m_s: s[3],
            yaw_rate_rad_s: s[4],
            acceleration_m_s2: before.0[0],
            yaw_acceleration_rad_s2: before.0[1],
            wheel_force_n: before.1,
            past: like.torques_n_m.is_some().then_some(&past),
        };
        let wheels = model.wheels_rad_s(&at);
        let spread = model.wheel_variance_rad2_s2(&at);
        for side in 0..2 {
            if out.wheels_rad_s[side][k].is_finite() {
                let std = (b.wheel_std_rad_s.powi(2) + spread[side]).sqrt();
                let mut value = wheels[side] + std * draw.normal();
                if let Some(Lost { loss, length_s, share, .. }) = claimed.lost.filter(|lost| lost.side == side) {
                    let leave = 1.0 - (-like.step_s / length_s).exp();
                    lost ^= draw.uniform() < if lost { leave } else { leave * share / (1.0 - share) };
                    value *= if lost { 1.0 - loss } else { 1.0 };
                }
                if let Some(lsb) = claimed.wheel_lsb_rad_s {
                    value = lsb * (value / lsb).round();
                }
                out.wheels_rad_s[side][k] = value;
            }
        }
        if let Some(gyro) = out.gyro_rad_s.as_mut().filter(|g| g[k].is_finite()) {
            let step = claimed.step_rad_s.filter(|_| t_s >= step_at_s).unwrap_or(0.0);
            let bias = warm_up.error_rad_s(like.since_power_on_s[k]) + walk + step;
            gyro[k] = model.gyro_rad_s(&at) + bias + b.gyro_std_rad_s * draw.normal();
        }
        been.push([s[0], s[1], s[2]]);
        if let Some(pose) = out.pose.as_mut() {
            let there = ago(&like.times_s[..=k], &been, pose_late_s);
            let stds = [b.position_std_m, b.position_std_m, b.heading_std_rad];
            for (i, std) in stds.into_iter().enumerate() {
                if pose[i][k].is_finite() {
                    pose[i][k] = there[i] + std * draw.normal();
                }
            }
        }
        let mut now = Moving { past: None, ..at };
        past.push(t_s, [s[3], s[4]], at.wheel_force_n);
        let Some(next) = like.times_s.get(k + 1) else { break };
        let dt = next - like.times_s[k];
        if let Some(size) = claimed.walk_rad_s_sqrt_s {
            walk += size * dt.sqrt() * draw.normal();
        }
        let torques = like.torques(k);
        let noise = if like.torques_n_m.is_some() { b.torque_noise_n_m_sqrt_s / dt.sqrt() } else { 0.0 };
        let torques = torques.map(|u| u + noise * draw.normal());
        model.accelerate(&mut now, torques);
        let sideways = model.sideways_m_s(&now);
        let mut middle = now;
        middle.speed_m_s += 0.5 * dt * now.acceleration_m_s2;
        middle.yaw_rate_rad_s += 0.5 * dt * now.yaw_acceleration_rad_s2;
        middle.heading_rad += 0.5 * dt * s[4];
        middle.x_m += 0.5 * dt * s[3] * s[2].cos();
        middle.y_m += 0.5 * dt * s[3] * s[2].sin();
        model.accelerate(&mut middle, torques);
        let [dv, dw] = match &driven {
            Some(driven) => [driven[k + 1][0] - s[3], driven[k + 1][1] - s[4]],
            None => [dt * middle.acceleration_m_s2, dt * middle.yaw_acceleration_rad_s2],
        };
        let mut turn = dt * (s[4] + 0.5 * dw);
        let (sin, cos) = (s[2] + 0.5 * turn).sin_cos();
        let mut way = dt * (s[3] + 0.5 * dv);
        if ripple > 0.0 {
            let std = (ripple * dt.powi(3) / 12.0).sqrt();
            let wheels = [std * draw.normal(), std * draw.normal()];
            let [ahead, about] = model.by_torque().map(|by| by[0] * wheels[0] + by[1] * wheels[1]);
            way += ahead;
            turn += about;
        }
        s[0] += way * cos - dt * sideways * sin;
        s[1] += way * sin + dt * sideways * cos;
        s[2] += turn;
        s[3] += dv;
        s[4] += dw;
        before = match &like.torques_n_m {
            Some(_) => ([now.acceleration_m_s2, now.yaw_acceleration_rad_s2], now.wheel_force_n),
            None => slopes.push(dt, [s[3], s[4]], model),
        };
    }
    out
}

/// The pose (x, y in m, heading in rad) `delay_s` before the last of `poses`: linear between the rows; the first before
/// them.
fn ago(times_s: &[f64], poses: &[[f64; 3]], delay_s: f64) -> [f64; 3] {
    let last = poses.len() - 1;
    let at_s = times_s[last] - delay_s;
    let from = times_s.partition_point(|t| *t <= at_s).saturating_sub(1).min(last);
    let to = (from + 1).min(last);
    let span_s = times_s[to] - times_s[from];
    let share = if span_s > 0.0 { ((at_s - times_s[from]) / span_s).clamp(0.0, 1.0) } else { 0.0 };
    std::array::from_fn(|i| poses[from][i] + share * (poses[to][i] - poses[from][i]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::drive::ids;
    use crate::effects::{Library, Parameters};
    use crate::gap::drive::preprocess::clocks::tests::{recorded, robot};

    #[test]
    fn ticks_are_lost_as_they_were_fitted() {
        let like = Record::new(&robot(), &recorded(60.0, 8, None), 0.0).unwrap();
        let (share, burst_s) = (0.3, 0.5);
        let simulated = |loss: f64| {
            let said = [("loss_fraction", loss), ("right", 1.0), ("burst_s", burst_s), ("share_of_time", share)];
            let parameters: Parameters = said.iter().map(|(name, value)| ((*name).into(), *value)).collect();
            let claimed = EffectSet::new(&[(ids::missed_ticks().into(), parameters)], &Library::new());
            own(&like, &claimed, Process::default(), 3).wheels_rad_s
        };
        // the same draws, with and without a loss
        let ([left, right], [whole_left, whole_right]) = (simulated(0.4), simulated(0.0));
        assert_eq!(left, whole_left);
        let lost: Vec<bool> = right.iter().zip(&whole_right).map(|(a, b)| a != b).collect();
        for (a, b) in right.iter().zip(&whole_right).filter(|(a, b)| a != b) {
            assert!((a / b - 0.6).abs() < 1e-12, "{a} {b}");
        }
        // the share of a chain of two states has the standard deviation share (1 - share) √(2 τ/T), τ = burst (1 -
        // share)
        let found = lost.iter().filter(|l| **l).count() as f64 / lost.len() as f64;
        let std = share * (1.0 - share) * (2.0 * burst_s * (1.0 - share) / like.span_s()).sqrt();
        assert!((found - share).abs() < 5.0 * std, "{found}");
        let bursts = lost.windows(2).filter(|w| !w[0] && w[1]).count() as f64;
        let length_s = found * like.span_s() / bursts;
        // exponential lengths: the mean of n scatters by 1/√n
        assert!((length_s / burst_s).ln().abs() < 5.0 / bursts.sqrt(), "{length_s} s in {bursts} bursts");
    }
}
