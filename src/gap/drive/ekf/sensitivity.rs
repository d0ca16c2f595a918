//! dν = h·D + d,  D⁺ = D - K dν,  D⁻ = F D⁺ + ∂f/∂β: the derivatives D of the state by every coefficient β; likewise
//! those of the change by noise in the last step, a part of which late readings hold.
//!
//! One array for each state, so that the loops over some two hundred columns run on vectors.

use super::filter::{N, PLACES, Step, TH, V, W, X, Y};
use super::filter_pass::{RowLinearization, ScalarUpdate};
use super::lasting::SlopeTangents;
use crate::gap::drive::ekf::models::{Beside, Models};
use crate::gap::drive::regressors::basis::{Column, Equation};
use crate::model::drive::{DriveEffect, Instrument, Moving, Past, Robot, Shape};

/// Derivatives of the state, and of the readings of the current row, by some of the columns.
pub(crate) struct Tangents<'a> {
    columns: Vec<Column>,
    models: &'a Models,
    state: [Vec<f64>; N],
    /// ∂(expected reading)/∂β at a fixed state, by channel
    direct: [Vec<f64>; 6],
    moved: Vec<f64>,
    /// Of the change of v and ω by noise in the last step, as estimated from the readings of this row
    shaken: [Vec<f64>; 2],
    /// For a coordinate that varies, the index of the coordinate's own column; for others, their own index
    varies: Vec<usize>,
    /// Derivatives of dv/dt, dω/dt and the sideways speed by each coordinate
    adds: Vec<[f64; 3]>,
    /// Shape of the change whose coordinates are being evaluated
    shapes: Shapes,
    /// Past speeds and yaw rates, where torques were logged
    past: Option<Past>,
    /// Of the accelerations that last, where none were
    lasting: Option<SlopeTangents>,
}

/// Cached shape of the change whose coordinates are being evaluated, in this row.
#[derive(Default)]
struct Shapes {
    of_row: Option<(usize, Shape)>,
}

impl Shapes {
    fn of(&mut self, change: usize, effect: &dyn DriveEffect, robot: &Robot, at: &Moving) -> &Shape {
        let known = self.of_row.take().filter(|known| known.0 == change);
        &self.of_row.insert(known.unwrap_or_else(|| (change, effect.shape(robot, at)))).1
    }
}

impl<'a> Tangents<'a> {
    /// All zero. A coordinate that varies stands after the column of the coordinate itself. `forced`: whether torques
    /// were logged.
    pub(crate) fn new(columns: Vec<Column>, models: &'a Models, forced: bool) -> Self {
        let columns: Vec<Column> = columns.into_iter().map(Column::evaluated).collect();
        let zero = || vec![0.0; columns.len()];
        let constant = |i, j| columns.iter().position(|c| *c == Column::Coordinate(i, j));
        let of = |(c, column): (usize, &Column)| match *column {
            Column::Varying(i, j, _) => constant(i, j).unwrap_or(c),
            _ => c,
        };
        Self {
            models,
            state: std::array::from_fn(|_| zero()),
            direct: std::array::from_fn(|_| zero()),
            moved: zero(),
            shaken: [zero(), zero()],
            varies: columns.iter().enumerate().map(of).collect(),
            adds: vec![[0.0; 3]; columns.len()],
            shapes: Shapes::default(),
            past: forced.then(Past::default),
            lasting: (!forced).then(SlopeTangents::default),
            columns,
        }
    }

    /// Moves the derivatives through one row; the whitened derivatives of its readings are appended to `slopes`.
    pub(crate) fn follow(&mut self, row: &RowLinearization, slopes: &mut Vec<f64>) {
        if row.placed {
            self.state[..PLACES].iter_mut().for_each(|s| s.fill(0.0));
        }
        if !row.taken.is_empty() {
            self.expect(row);
            self.shaken.iter_mut().for_each(|s| s.fill(0.0));
            row.taken.iter().for_each(|taken| self.correct(taken, slopes));
        }
        if let Some(past) = &mut self.past {
            past.push(row.at.t_s, row.speeds, row.at.wheel_force_n);
        }
        if row.goes_on {
            self.predict(row);
        }
    }

    /// Direct derivatives of a row's expected readings by β, at a fixed state.
    fn expect(&mut self, row: &RowLinearization) {
        let (sin, cos) = row.heading;
        let at = Moving { past: self.past.as_ref(), ..row.at };
        let d = &mut self.direct;
        for (c, column) in self.columns.iter().enumerate() {
            match *column {
                Column::Coordinate(i, j) => {
                    let Beside { model, step, touches, .. } = &self.models.beside[i][j];
                    if touches.wheels {
                        let [l, r] = model.wheels_rad_s(&at);
                        (d[0][c], d[1][c]) = ((l - row.here[0]) / step, (r - row.here[1]) / step);
                    }
                    if touches.gyro {
                        d[2][c] = (model.gyro_rad_s(&at) - row.here[2]) / step;
                    }
                    if touches.pose {
                        let there = at.pose_ago(model.delay_s(Instrument::Pose));
                        for (channel, (there, here)) in d[3..].iter_mut().zip(there.into_iter().zip(row.pose_ago)) {
                            channel[c] = (there - here) / step;
                        }
                    }
                }
                Column::Varying(_, _, f) => {
                    let (of, value) = (self.varies[c], row.functions[f]);
                    for channel in d.iter_mut() {
                        channel[c] = value * channel[of];
                    }
                }
                Column::Usual(_) | Column::Free(..) | Column::Hat(..) => {
                    let Some((equation, value)) = column.added(&row.functions, row.at.t_s) else { continue };
                    match equation {
                        Equation::WheelLeft => d[0][c] = value,
                        Equation::WheelRight => d[1][c] = value,
                        Equation::Gyro => d[2][c] = value,
                        Equation::PoseAlong => (d[3][c], d[4][c]) = (value * cos, value * sin),
                        Equation::PoseAcross => (d[3][c], d[4][c]) = (-value * sin, value * cos),
                        Equation::PoseHeading => d[5][c] = value,
                        Equation::Force | Equation::Moment | Equation::Sideways | Equation::Along | Equation::Turn => {}
                    }
                }
                Column::PoseDelay => {
                    let v = row.at.speed_m_s;
                    (d[3][c], d[4][c], d[5][c]) = (-v * cos, -v * sin, -row.at.yaw_rate_rad_s);
                }
                Column::TurnOn => d[2][c] = 1.0,
                Column::WarmUpSize => d[2][c] = row.warm_up[0],
                Column::WarmUpTime => d[2][c] = row.warm_up[1],
                Column::GyroCosine(n) => d[2][c] = row.cosines[n],
                Column::GyroStep(from_s) => d[2][c] = f64::from(u8::from(row.at.t_s >= from_s)),
                Column::GyroSettling(from_s, within_s) => {
                    let since_s = row.at.t_s - from_s;
                    d[2][c] = if since_s >= 0.0 { -(-since_s / within_s).exp() } else { 0.0 };
                }
            }
        }
    }

    /// Update by one scalar reading.
    fn correct(&mut self, taken: &ScalarUpdate, slopes: &mut Vec<f64>) {
        self.moved.copy_from_slice(&self.direct[taken.channel as usize]);
        for (h, state) in taken.h.iter().zip(&self.state) {
            if *h != 0.0 {
                self.moved.iter_mut().zip(state).for_each(|(m, s)| *m += h * s);
            }
        }
        for (by, shaken) in taken.late.iter().zip(&self.shaken).filter(|(by, _)| **by != 0.0) {
            self.moved.iter_mut().zip(shaken).for_each(|(m, s)| *m -= by * s);
        }
        for (gain, shaken) in taken.shaken_gain.iter().zip(&mut self.shaken).filter(|(gain, _)| **gain != 0.0) {
            shaken.iter_mut().zip(&self.moved).for_each(|(s, m)| *s -= gain * m);
        }
        for (gain, state) in taken.gain.iter().zip(&mut self.state) {
            state.iter_mut().zip(&self.moved).for_each(|(s, m)| *s -= gain * m);
        }
        let whitens = taken.std.recip();
        slopes.extend(self.moved.iter().map(|m| m * whitens));
    }

    /// Prediction to the next row.
    fn predict(&mut self, row: &RowLinearization) {
        self.advance(row);
        if let Some(lasting) = &mut self.lasting {
            lasting.arrive(&mut self.state, &row.step.lasting, row.step.dt, row.middle);
        }
    }

    /// The same by the model alone.
    fn advance(&mut self, row: &RowLinearization) {
        let (at, f, functions) = (&row.leaving, &row.f, &row.functions_ahead);
        let Step { torques, sideways, dt, .. } = row.step;
        let p = self.columns.len();
        let [x, y, th, v, w] = &mut self.state;
        let (x, y, th, v, w) = (&mut x[..p], &mut y[..p], &mut th[..p], &mut v[..p], &mut w[..p]);
        let pulled = self.models.here.follows_position;
        for c in 0..p {
            let (dx, dy, dth, dv, dw) = (x[c], y[c], th[c], v[c], w[c]);
            x[c] += f[X][TH] * dth + f[X][V] * dv + f[X][W] * dw;
            y[c] += f[Y][TH] * dth + f[Y][V] * dv + f[Y][W] * dw;
            th[c] += f[TH][V] * dv + f[TH][W] * dw;
            v[c] = f[V][TH] * dth + f[V][V] * dv + f[V][W] * dw;
            w[c] = f[W][TH] * dth + f[W][V] * dv + f[W][W] * dw;
            if pulled {
                v[c] += f[V][X] * dx + f[V][Y] * dy;
                w[c] += f[W][X] * dx + f[W][Y] * dy;
            }
        }
        let (sin, cos) = row.middle;
        self.shapes.of_row = None;
        for (c, column) in self.columns.iter().enumerate() {
            // dv/dt, dω/dt, sideways
            let d = match *column {
                Column::Coordinate(i, j) => {
                    let Beside { model, step, touches, known, own } = &self.models.beside[i][j];
                    if !touches.motion {
                        continue;
                    }
                    let mut moved = *at;
                    if let Some(torques) = torques {
                        model.accelerate_with(&mut moved, torques, |place, effect| {
                            let shape =
                                || effect.force_of(self.shapes.of(i, effect, &model.robot, at), &model.robot, at);
                            let same = known[place].map(|same| row.forces[same]);
                            same.or_else(|| (*own == Some(place)).then(shape))
                        });
                    }
                    self.adds[c] = [
                        (moved.acceleration_m_s2 - at.acceleration_m_s2) / step,
                        (moved.yaw_acceleration_rad_s2 - at.yaw_acceleration_rad_s2) / step,
                        (model.sideways_m_s(at) - sideways) / step,
                    ];
                    self.adds[c]
                }
                Column::Varying(_, _, f) => self.adds[self.varies[c]].map(|a| a * functions[f]),
                _ => match column.added(functions, at.t_s) {
                    // outside its two intervals a triangle adds nothing
                    Some((_, 0.0)) => continue,
                    Some((Equation::Force, value)) => [value, 0.0, 0.0],
                    Some((Equation::Moment, value)) => [0.0, value, 0.0],
                    Some((Equation::Sideways, value)) => [0.0, 0.0, value],
                    Some((Equation::Along, value)) => {
                        x[c] += dt * value * cos;
                        y[c] += dt * value * sin;
                        continue;
                    }
                    Some((Equation::Turn, value)) => {
                        th[c] += dt * value;
                        continue;
                    }
                    _ => continue,
                },
            };
            v[c] += dt * d[0];
            w[c] += dt * d[1];
            let (half_way, half_turn) = (0.5 * dt * dt * d[0], 0.5 * dt * dt * d[1]);
            x[c] += half_way * cos - dt * d[2] * sin;
            y[c] += half_way * sin + dt * d[2] * cos;
            th[c] += half_turn;
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::config::Config;
    use crate::effects::Library;
    use crate::effects::drive::{by_id, ids};
    use crate::gap::drive::ekf::innovations::run;
    use crate::gap::drive::ekf::noise::{Channel, Noise, Process};
    use crate::gap::drive::fit::models;
    use crate::gap::drive::preprocess::acceleration_model::tests::{belief, recorded};
    use crate::gap::drive::record::Record;
    use crate::gap::drive::record::reckoning::FirstPose;
    use crate::gap::drive::regressors::basis::Column;
    use crate::simulate::{Course, Options, drive_with};

    /// A robot without noise or inertia of its wheels, bound to a point by a spring.
    const BOUND: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.01\n\
        [gyro]\nc1_rad_s = 0.0\nc2_rad_s = 0.0\ntime_constant_s = 300.0\nangle_random_walk_rad_sqrt_s = 0.0\n\
        [vehicle]\nmass_kg = 9.5\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\nwheel_radius_m = 0.05\n\
        wheel_inertia_kg_m2 = 0.0\nviscous_friction_n_m_s = 0.0006\ntorque_noise_n_m_sqrt_s = 0.0\n\
        [encoder]\nspeed_noise_std_rad_s = 0.0\n[pose]\nrate_hz = 5.0\nposition_std_m = 0.0\nheading_std_rad = 0.0\n\
        [[custom_effect]]\nid = \"custom.spring\"\ntitle = \"spring\"\nacts_on = \"force_n\"\n\
        expression = \"stiffness*((0.3 - x_m)*cos(heading_rad) + (far - y_m)*sin(heading_rad))\"\n\
        [[custom_effect.parameter]]\nname = \"stiffness\"\nunit = \"N/m\"\nbounds = [0.0, 99.0]\nnull = 0.0\n\
        plausible = [0.1, 30.0]\nmeaning = \"k\"\n\
        [[custom_effect.parameter]]\nname = \"far\"\nunit = \"m\"\nbounds = [-9.0, 9.0]\nplausible = [-1.0, 2.0]\n\
        meaning = \"y of the point\"\n[[effect]]\nid = \"custom.spring\"\nstiffness = 6.0\nfar = 0.8\n";

    /// Innovations are next to zero here, so that the gains, which depend on the coordinates as well, do not matter.
    #[test]
    fn derivatives_by_a_force_that_follows_the_position_are_those_of_the_innovations() {
        let quiet = Config::parse(BOUND, "sim.toml").unwrap();
        let library = Library::new().with_own(&quiet).unwrap();
        let log = drive_with(&quiet, Course::Brisk, 6.0, &Options::from(3), &library).unwrap().log;
        let noisy = Config { effects: Vec::new(), ..quiet };
        let mut record = Record::new(&noisy, &log, 0.0).unwrap();
        let belief = &mut record.belief;
        (belief.gyro_std_rad_s, belief.wheel_std_rad_s, belief.torque_noise_n_m_sqrt_s) = (1e-3, 0.02, 4e-4);
        (belief.position_std_m, belief.heading_std_rad) = (2e-3, 2e-3);
        let noise = Noise::believed(&record, None);
        let change = library.driving().find_map(|e| e.change().filter(|_| e.about().title == "spring")).unwrap();
        let parameters = [("stiffness".to_owned(), 6.0), ("far".to_owned(), 0.8)].into();
        let theta = vec![change.theta(&parameters)];
        let columns = [Column::Coordinate(0, 0), Column::Coordinate(0, 1)];
        let mut told: Vec<[f64; 3]> = Vec::new();
        let _ = run(&record, &models(&record, &[change], &theta, true), &noise, &columns, |i| {
            told.push([i.white * i.std, i.slopes[0] * i.std, i.slopes[1] * i.std]);
        });
        for j in 0..2 {
            let step = 1e-4;
            let moved = |by: f64| {
                let mut there = theta.clone();
                there[0][j] += by;
                let mut nu = Vec::new();
                let _ =
                    run(&record, &models(&record, &[change], &there, false), &noise, &[], |i| nu.push(i.white * i.std));
                nu
            };
            let (up, down) = (moved(step), moved(-step));
            let largest = told.iter().fold(0.0f64, |most, t| most.max(t[1 + j].abs()));
            for ((up, down), told) in up.iter().zip(&down).zip(&told) {
                let slope = (down - up) / (2.0 * step);
                // the filter's derivatives are those of one step of Euler's
                assert!((slope - told[1 + j]).abs() < 0.02 * largest, "{j}: {slope} {told:?}, largest {largest}");
            }
        }
    }

    const STEP_S: f64 = 0.02;

    /// A robot that speeds up and turns evenly, its torques not logged: innovations are next to zero where accelerations last. The pose
    /// is read every tenth row from `posed` on.
    fn even(posed: usize) -> Record {
        let mut record = recorded(belief(), STEP_S, [Vec::new(), Vec::new()], Vec::new());
        let (rows, robot) = (300, record.belief.robot);
        let times = (0..rows).map(|k| STEP_S * k as f64);
        (record.times_s, record.since_power_on_s) = (times.clone().collect(), times.clone().collect());
        let speeds: Vec<[f64; 2]> = times.map(|t| [0.1 + 0.2 * t, 0.3 * t - 0.5]).collect();
        record.gyro_rad_s = Some(speeds.iter().map(|s| s[1]).collect());
        record.wheels_rad_s = [0, 1].map(|side| speeds.iter().map(|s| robot.wheels_rad_s(s[0], s[1])[side]).collect());
        let mut pose = [1.0, -2.0, 0.7];
        let mut poses = [const { Vec::new() }; 3];
        for (k, [v, w]) in speeds.iter().enumerate() {
            let read = k >= posed && k % 10 == 0;
            poses.iter_mut().zip(pose).for_each(|(all, p)| all.push(if read { p } else { f64::NAN }));
            let [v, w] = [v + 0.1 * STEP_S, w + 0.15 * STEP_S];
            let (sin, cos) = f64::sin_cos(pose[2] + 0.5 * STEP_S * w);
            pose = [pose[0] + STEP_S * v * cos, pose[1] + STEP_S * v * sin, pose[2] + STEP_S * w];
        }
        record.pose = (posed < rows).then_some(poses);
        record
    }

    /// Compares the derivatives by the wheels' radius with differences of the innovations, from the reading `from` on; channel and
    /// innovation of each.
    fn radius_is_told(record: &Record, from: usize) -> Vec<(Channel, f64)> {
        let mut noise = Noise::believed(record, None);
        noise.process = Process { diffusion: [1e-3, 2e-3], lasting: 0.9, ..Process::default() };
        let change = by_id(ids::radius_scale()).and_then(|e| e.change()).unwrap();
        let innovations = |by: f64| {
            let mut nu = Vec::new();
            let models = models(record, &[change], &vec![vec![by]], false);
            let _ = run(record, &models, &noise, &[], |i| nu.push(i.white * i.std));
            nu
        };
        let (mut told, mut here) = (Vec::new(), Vec::new());
        let there = models(record, &[change], &vec![vec![0.0]], true);
        let _ = run(record, &there, &noise, &[Column::Coordinate(0, 0)], |i| {
            told.push(i.slopes[0] * i.std);
            here.push((i.channel, i.white * i.std));
        });
        let step = 1e-4;
        let (up, down) = (innovations(step), innovations(-step));
        let slopes: Vec<f64> = up.iter().zip(&down).map(|(up, down)| (down - up) / (2.0 * step)).collect();
        for k in from..told.len() {
            let same = here.iter().zip(&slopes).filter(|(other, _)| other.0 == here[k].0);
            let largest = same.fold(0.0f64, |most, (_, slope)| most.max(slope.abs()));
            assert!((slopes[k] - told[k]).abs() < 0.02 * largest, "{k}: {} {}, largest {largest}", slopes[k], told[k]);
        }
        here
    }

    #[test]
    fn derivatives_of_accelerations_that_last_are_those_of_the_innovations() {
        // beyond the first readings, by which the filter finds the acceleration
        radius_is_told(&even(usize::MAX), 3 * 20);
    }

    /// A robot that is first seen on its way, as after a wait for satellites, or between two marks.
    #[test]
    fn a_pose_that_is_first_read_on_the_way_tells_what_follows() {
        let record = even(150);
        let innovations = radius_is_told(&record, 3 * 20);
        let poses = innovations.iter().filter(|(channel, _)| *channel as usize >= 3);
        assert_eq!(poses.clone().count(), 3 * 15);
        // the standard deviation of a reading is some hundred times that
        poses.for_each(|(channel, nu)| assert!(nu.abs() < 1e-4, "{channel:?}: {nu}"));
        // where it stood at the beginning is known by dead reckoning
        let first = FirstPose::of(&record, 0..record.len()).unwrap();
        let start = first.back_at(&record, 0);
        assert_eq!(first.row, 150);
        assert!(start.iter().zip([1.0, -2.0, 0.7]).all(|(a, b)| (a - b).abs() < 0.02), "{start:?}");
    }
}
