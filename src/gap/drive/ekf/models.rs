//! f, h at β, and moved from β by a step in each coordinate
//!
//! Drives in which the robot carries different known loads have a model each, at the same β.

use crate::effects::drive::Touches;
use crate::gap::drive::record::Record;
use crate::model::drive::DriveModel;

/// Models of one pass: at β, and moved by a step in each coordinate.
pub(crate) struct Models {
    /// Model at β, with the load of the first drive.
    pub here: DriveModel,
    /// Moved models, by change and coordinate.
    pub beside: Vec<Vec<Beside>>,
    /// The same with each further load that a drive has.
    others: Vec<Models>,
}

/// The model moved from β by a step in one coordinate.
pub(crate) struct Beside {
    /// Moved model.
    pub model: DriveModel,
    /// Size of the step, in the coordinate's unit.
    pub step: f64,
    /// Equations that the coordinate changes.
    pub touches: Touches,
    /// For each of its effects, index of the effect with identical force in the model at β, whose force is reused;
    /// none: computed.
    pub known: Vec<Option<usize>>,
    /// Index of the coordinate's own effect, if on this robot it has the same shape as at β.
    pub own: Option<usize>,
}

impl Models {
    /// `here`, whatever the load.
    #[must_use]
    pub(crate) fn alone(here: DriveModel, beside: Vec<Vec<Beside>>) -> Self {
        Self { here, beside, others: Vec::new() }
    }

    /// Models with each load (kg) that a drive of `record` has, which `with` makes.
    #[must_use]
    pub(crate) fn of_each_load(record: &Record, with: impl Fn(f64) -> Self) -> Self {
        let mut loads_kg: Vec<f64> = Vec::new();
        for load_kg in &record.loads_kg {
            if !loads_kg.contains(load_kg) {
                loads_kg.push(*load_kg);
            }
        }
        let mut all = loads_kg.iter().map(|load_kg| with(*load_kg));
        let first = all.next().unwrap_or_else(|| with(0.0));
        Self { others: all.collect(), ..first }
    }

    /// The nominal model: given effects alone.
    #[must_use]
    pub(crate) fn plain(record: &Record) -> Self {
        Self::of_each_load(record, |load_kg| Self::alone(record.model(load_kg, Vec::new()), Vec::new()))
    }

    /// The models with this load, kg; those of the first drive where none has it.
    #[must_use]
    pub(crate) fn carrying(&self, load_kg: f64) -> &Self {
        let carries = |models: &&Self| models.here.robot.load_kg == load_kg;
        std::iter::once(self).chain(&self.others).find(carries).unwrap_or(self)
    }

    /// The model at β with each load.
    pub(crate) fn of_loads(&self) -> impl Iterator<Item = &DriveModel> {
        std::iter::once(self).chain(&self.others).map(|models| &models.here)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::effects::Parameters;
    use crate::effects::drive::{Coordinate, ModelChange, by_id, ids};
    use crate::gap::diagnosis::Drive;
    use crate::gap::drive::ekf::innovations::run;
    use crate::gap::drive::ekf::noise::Noise;
    use crate::gap::drive::fit::models;
    use crate::gap::drive::regressors::basis::Column;
    use crate::gap::drive::regressors::practical_identifiability::LN_ODDS;
    use crate::model::drive::{DriveEffect, GRAVITY_M_S2, Robot};
    use crate::signal::{Log, names};
    use crate::simulate::{Course, Options, drive};
    use nalgebra::{DMatrix, Matrix2, Vector2};

    /// A robot without noise, friction, and inertia of its wheels.
    const QUIET: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.01\n\
        [gyro]\nc1_rad_s = 0.0\nc2_rad_s = 0.0\ntime_constant_s = 300.0\nangle_random_walk_rad_sqrt_s = 0.0\n\
        [vehicle]\nmass_kg = 10.0\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\nwheel_radius_m = 0.05\n\
        wheel_inertia_kg_m2 = 0.0\nviscous_friction_n_m_s = 0.0\ntorque_noise_n_m_sqrt_s = 0.0\n\
        [encoder]\nspeed_noise_std_rad_s = 0.0\n";
    const MASS_KG: f64 = 10.0;
    const LOAD_KG: f64 = 3.0;

    /// Both motors stronger by the same factor.
    struct Motors;

    impl ModelChange for Motors {
        fn coordinates(&self) -> &'static [Coordinate] {
            &[Coordinate { scale: [0.01, 0.3], bounds: [-0.5, 1.0] }]
        }

        fn at(&self, theta: &[f64]) -> Box<dyn DriveEffect> {
            Box::new(Gain(theta[0]))
        }

        fn parameters(&self, _: &[f64]) -> Parameters {
            Parameters::new()
        }

        fn theta(&self, _: &Parameters) -> Vec<f64> {
            vec![0.0]
        }
    }

    struct Gain(f64);

    impl DriveEffect for Gain {
        fn robot(&self, robot: &mut Robot) {
            robot.torque_gain = robot.torque_gain.map(|gain| gain * (1.0 + self.0));
        }
    }

    fn changes() -> [&'static dyn ModelChange; 2] {
        [&Motors, by_id(ids::payload()).and_then(|e| e.change()).unwrap()]
    }

    /// Drives with these loads of a robot whose motors are this much stronger than stated, as a filter with noise reads them.
    fn driven(loads_kg: &[f64], gain: f64) -> Record {
        let quiet = Config::parse(QUIET, "robot.toml").unwrap();
        let logs: Vec<Log> = (3..)
            .zip(loads_kg)
            .map(|(seed, load_kg)| {
                let mut log = drive(&quiet.carrying(*load_kg), Course::Brisk, 20.0, &Options::from(seed)).unwrap().log;
                let torques = log
                    .channels
                    .iter_mut()
                    .filter(|c| [names::TORQUE_LEFT, names::TORQUE_RIGHT].contains(&c.name.as_str()));
                torques.for_each(|c| c.values.iter_mut().for_each(|u| *u /= 1.0 + gain));
                log
            })
            .collect();
        let drives: Vec<Drive> =
            logs.iter().zip(loads_kg).map(|(log, kg)| Drive::new(log, 0.0).carrying(*kg)).collect();
        let mut record = Record::of_drives(&quiet, &drives).unwrap();
        let belief = &mut record.belief;
        (belief.gyro_std_rad_s, belief.wheel_std_rad_s, belief.torque_noise_n_m_sqrt_s) = (1e-3, 0.02, 4e-3);
        record
    }

    fn innovations(record: &Record, theta: &[Vec<f64>]) -> Vec<f64> {
        let mut all = Vec::new();
        let models = models(record, &changes(), &theta.to_vec(), false);
        let _ = run(record, &models, &Noise::believed(record, None), &[], |i| all.push(i.white * i.std));
        all
    }

    #[test]
    fn a_load_is_weighed_and_no_effect_changes_it() {
        let record = driven(&[0.0, LOAD_KG, 0.0], 0.0);
        assert_eq!((record.loads_kg.clone(), record.belief.robot.load_kg), (vec![0.0, LOAD_KG, 0.0], 0.0));
        let models = models(&record, &changes(), &vec![vec![0.0], vec![0.2, 0.1]], false);
        assert_eq!(models.of_loads().count(), 2);
        for (rows, load_kg) in record.drives().zip(&record.loads_kg) {
            assert_eq!((record.load_kg(rows.start), record.load_kg(rows.end - 1)), (*load_kg, *load_kg));
            let robot = models.carrying(*load_kg).here.robot;
            assert!((robot.mass_kg - (1.2 * MASS_KG + load_kg)).abs() < 1e-12, "{robot:?}");
            assert!((robot.yaw_inertia_kg_m2 - 1.1 * 0.21).abs() < 1e-12, "{robot:?}");
            assert!((robot.wheel_load_n() - 0.5 * robot.mass_kg * GRAVITY_M_S2).abs() < 1e-12);
        }
        // each drive by itself, moved, cut and joined again, has its own
        let halves = record.by_drive(|_, drive| drive.window(drive.len() / 2..drive.len()));
        assert_eq!(halves.loads_kg, record.loads_kg);
        assert_eq!(record.apart().map(|d| d.loads_kg[0]).collect::<Vec<_>>(), record.loads_kg);
        assert_eq!(record.window(record.starts[1] + 9..record.len()).loads_kg, [LOAD_KG, 0.0]);
    }

    /// Innovations are next to zero here, so that the gains, which depend on the coordinates as well, do not matter.
    #[test]
    fn derivatives_of_drives_with_different_loads_are_those_of_the_innovations() {
        let record = driven(&[0.0, LOAD_KG], 0.05);
        let theta = vec![vec![0.05], vec![0.0, 0.0]];
        let columns = [Column::Coordinate(0, 0), Column::Coordinate(1, 0), Column::Coordinate(1, 1)];
        let mut told: Vec<[f64; 3]> = Vec::new();
        let moved = models(&record, &changes(), &theta, true);
        let _ = run(&record, &moved, &Noise::believed(&record, None), &columns, |i| {
            told.push([0, 1, 2].map(|j| i.slopes[j] * i.std));
        });
        // with the load of one drive left out the readings are not those of the model
        let size = |all: &[f64]| all.iter().map(|nu| nu * nu).sum::<f64>().sqrt();
        let unloaded = Record { loads_kg: vec![0.0; 2], ..record.clone() };
        assert!(size(&innovations(&record, &theta)) < 0.02 * size(&innovations(&unloaded, &theta)));
        let step = 1e-4;
        for (j, (change, coordinate)) in [(0, 0), (1, 0), (1, 1)].into_iter().enumerate() {
            let at = |by: f64| {
                let mut there = theta.clone();
                there[change][coordinate] += by;
                innovations(&record, &there)
            };
            let (up, down) = (at(step), at(-step));
            for rows in [0..told.len() / 2, told.len() / 2..told.len()] {
                let largest = told[rows.clone()].iter().fold(0.0f64, |most, t| most.max(t[j].abs()));
                for k in rows {
                    let slope = (down[k] - up[k]) / (2.0 * step);
                    // the filter's derivatives are those of one step of Euler's
                    assert!((slope - told[k][j]).abs() < 0.02 * largest, "{j} {k}: {slope} {:?} {largest}", told[k]);
                }
            }
        }
    }

    /// Information on both motors' gain, the mass and the yaw inertia.
    fn information(record: &Record) -> DMatrix<f64> {
        let theta = vec![vec![0.0], vec![0.0, 0.0]];
        let columns = [Column::Coordinate(0, 0), Column::Coordinate(1, 0), Column::Coordinate(1, 1)];
        let summed =
            run(record, &models(record, &changes(), &theta, true), &Noise::believed(record, None), &columns, |_| {});
        DMatrix::from_fn(3, 3, |i, j| summed.gram[(i, j)])
    }

    /// Expected evidence of a gain over the mass and inertia that resemble it most: ½ γ² (A_gg - A_gm A_mm⁻¹ A_mg).
    fn evidence(record: &Record, gain: f64) -> f64 {
        let a = information(record);
        let (of_mass, both) = (Matrix2::from_fn(|i, j| a[(1 + i, 1 + j)]), Vector2::new(a[(1, 0)], a[(2, 0)]));
        0.5 * gain * gain * (a[(0, 0)] - both.dot(&(of_mass.try_inverse().unwrap() * both)))
    }

    /// dv/dt = (1 + γ) u/(M (1 + m) + L): a gain is -m without the load, and -m (M + L)/M with it. A_e and A_l being the
    /// information of the empty and of the loaded drive on mass and inertia, the evidence is ½ (γ L/M)² [(A_e⁻¹ + A_l⁻¹)⁻¹]_mm.
    #[test]
    fn a_known_load_tells_the_motors_from_the_mass() {
        let gain = 0.1;
        let (empty, both) = (driven(&[0.0, 0.0], 0.0), driven(&[0.0, LOAD_KG], 0.0));
        let inverse = |drive: &Record| {
            let a = information(drive);
            Matrix2::from_fn(|i, j| a[(1 + i, 1 + j)]).try_inverse().unwrap()
        };
        let apart = both.apart().map(|drive| inverse(&drive)).fold(Matrix2::zeros(), |sum, one| sum + one);
        let theory = 0.5 * (gain * LOAD_KG / MASS_KG).powi(2) * apart.try_inverse().unwrap()[(0, 0)];
        let (told, without) = (evidence(&both, gain), evidence(&empty, gain));
        assert!((told / theory - 1.0).abs() < 0.02, "{told} nats, and {theory} by theory");
        assert!(told > 3.0 * LN_ODDS && without.abs() < 1e-3 * told, "{told} nats with a load, {without} without");
        // told nothing of the load, the diagnosis has none of it
        let untold = Record { loads_kg: vec![0.0; 2], ..both };
        assert!(evidence(&untold, gain).abs() < 1e-3 * told);
    }
}
