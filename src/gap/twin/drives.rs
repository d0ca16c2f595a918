//! The twin of a simulator of drives.

use super::constants::{Constant, Constants, warming};
use super::parameters::{moved, parameters, turn_ons};
use super::quality::channels;
use super::refine::{Fitted, Fitting, Normal};
use super::start;
use super::told::{Provenance, Twin, TwinEffect};
use crate::config::{Config, EffectTable, Encoder, Gyro, Kind, Pose, Vehicle};
use crate::effects::drive::{DriveExplanation, Driving, ModelChange};
use crate::effects::{Library, Parameters};
use crate::error::{Error, ErrorKind, Result};
use crate::gap::answer::{Answer, Verdict};
use crate::gap::diagnosis::{Drive, Options, Stage};
use crate::gap::drive::preprocess::clocks;
use crate::gap::drive::record::Record;
use crate::math::robust::{SECOND_DIFFERENCE, second_difference_std};
use crate::model::drive::Robot;

/// Shortest log of a simulator, s.
const SHORTEST_S: f64 = 1.0;
/// Diagnoses of the simulator's log, each with what the one before named.
const ROUNDS: usize = 4;
/// First guess of the noise of a simulator's pose, m and rad.
const SIMULATED_POSE_STD: [f64; 2] = [0.005, 0.005];
/// First guess of the torques' noise over one row, as a share of their root mean square.
const TORQUE_SHARE: f64 = 0.05;
/// Recordings simulated for the floor while effects are sought.
const SIMULATED: usize = 2;
/// Standard deviation of ln T of a warm-up whose time constant is one of those that are tried: they lie a factor of 2.5 apart.
const APART: f64 = 0.26;
/// Share of a channel's size below which its noise is rounding.
const ROUNDING: f64 = 1e-6;

/// An effect that the twin holds.
struct Held {
    id: String,
    change: &'static dyn ModelChange,
    theta: Vec<f64>,
}

/// The twin under construction.
struct Building<'a> {
    config: Config,
    init: Option<&'a Config>,
    runs: &'a [Drive<'a>],
    library: &'a Library,
    own: &'static Constants,
    held: Vec<Held>,
    /// Effects that are given as they were found: delays and quantization.
    fixed: Vec<EffectTable>,
    notes: Vec<String>,
}

/// Identifies the twin of the simulator that made `runs`. What the log does not tell is taken from `init`.
///
/// # Errors
/// [`ErrorKind::TooShort`] for a log shorter than a second, and as [`Record::of_drives`]; [`ErrorKind::Value`] for constants that
/// neither the log nor `init` tells, or that come out with the wrong sign.
pub fn twin_of_drives(
    init: Option<&Config>,
    runs: &[Drive<'_>],
    library: &Library,
    options: &Options,
    observe: &mut dyn FnMut(Stage),
) -> Result<Twin> {
    observe(Stage::Prepare);
    for run in runs {
        let span_s = run.log.time.span_s();
        if span_s < SHORTEST_S {
            return Err(Error::new(ErrorKind::TooShort, &run.log.source, format!("{span_s:.2} s of a simulator"))
                .hint("log a second at least; a minute with starts, stops and turns both ways tells all constants"));
        }
    }
    let mut building = Building::begin(init, runs, library)?;
    let mut fitting = building.fit()?;
    fitting = building.warm(fitting);
    let mut normal = building.settle(&mut fitting);
    observe(Stage::Compare);
    let mut account;
    let mut round = 0;
    loop {
        let few = Options { simulated_logs: SIMULATED, ..options.clone() };
        account = crate::gap::drive::diagnose(&building.config, runs, &[], library, &few, &mut |_| {})?.answer;
        round += 1;
        if round == ROUNDS || !building.take_in(&account) {
            break;
        }
        fitting = building.fit()?;
        normal = building.settle(&mut fitting);
    }
    observe(Stage::Measure);
    Ok(building.told(fitting, &normal, account))
}

impl<'a> Building<'a> {
    fn begin(init: Option<&'a Config>, runs: &'a [Drive<'a>], library: &'a Library) -> Result<Self> {
        let first = runs.first().ok_or_else(|| Error::new(ErrorKind::TooShort, "simulator", "no log"))?.log;
        let config = placeholder(init, first.time.median_step_s());
        let record = Record::of_drives(&config, runs)?;
        let mut building = Self {
            config,
            init,
            runs,
            library,
            own: &warming()[3],
            held: Vec::new(),
            fixed: Vec::new(),
            notes: Vec::new(),
        };
        building.begin_with(&record)?;
        Ok(building)
    }

    /// Start values, noise included.
    fn begin_with(&mut self, record: &Record) -> Result<()> {
        let source = record.sources.join("; ");
        let told = start::of(record);
        let given = self.init.and_then(|c| c.vehicle);
        let mut missing: Vec<&str> = Vec::new();
        let mut need = |told: Option<f64>, given: Option<f64>, name: &'static str| {
            told.or(given).unwrap_or_else(|| {
                missing.push(name);
                1.0
            })
        };
        let by_ways = told.radius_m.map(|r| 0.5 * (r[0] + r[1]));
        let radius = need(by_ways, given.map(|v| v.wheel_radius_m), "wheel_radius_m (needs a pose)");
        let by_turns = told.turn.map(|a| radius / (a[0] + a[1]));
        let half_track =
            need(by_turns, given.map(|v| v.half_track_m), "half_track_m (needs a gyro or a heading, and turns)");
        let wheel_inertia = given.map_or(0.0, |v| v.wheel_inertia_kg_m2);
        let wheels_kg = 2.0 * wheel_inertia / radius.powi(2);
        let positive = |v: f64| Some(v).filter(|v| *v > 0.0);
        let mass = told.force.and_then(|f| positive(1.0 / (f.by_torque * radius.powi(2)) - wheels_kg));
        let inertia =
            told.moment.and_then(|m| positive(half_track.powi(2) * (1.0 / (m.by_torque * radius.powi(2)) - wheels_kg)));
        if let (Some(force), true) = (told.force, record.torques_n_m.is_some())
            && force.by_torque <= 0.0
        {
            return Err(Error::new(ErrorKind::Value, source, "the torques slow the wheels that they should turn")
                .at("channels torque_left_n_m, torque_right_n_m")
                .hint("turn their sign: --map torque_left_n_m=-COLUMN --map torque_right_n_m=-COLUMN"));
        }
        // without torques they decide nothing
        let unit = record.torques_n_m.is_none().then_some(1.0);
        let mass = need(mass, given.map(|v| v.mass_kg).or(unit), "mass_kg (needs torques)");
        let inertia =
            need(inertia, given.map(|v| v.yaw_inertia_kg_m2).or(unit), "yaw_inertia_kg_m2 (needs torques, and turns)");
        if !missing.is_empty() {
            return Err(Error::new(ErrorKind::Value, source, format!("the log does not tell {}", missing.join(", ")))
                .hint("log what it needs, or give the values in a configuration: --init robot.toml (gyroid init --urdf, --sdf or --mjcf writes one)"));
        }
        let viscous = told.force.map_or(given.map_or(0.0, |v| v.viscous_friction_n_m_s), |f| f.viscous_n_m_s.max(0.0));
        let step_s = record.step_s;
        self.config.sample_time_s = Some(step_s);
        let size = |values: &[f64]| {
            let there = values.iter().filter(|v| v.is_finite());
            (there.clone().map(|v| v * v).sum::<f64>() / there.count().max(1) as f64).sqrt()
        };
        let noise = |values: &[f64]| {
            let there: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
            let std = second_difference_std([there.as_slice()]) / SECOND_DIFFERENCE.sqrt();
            std.max(ROUNDING * size(&there)).max(f64::MIN_POSITIVE.sqrt())
        };
        let torque = record.torques_n_m.as_ref().map_or(0.0, |[l, r]| 0.5 * (size(l) + size(r)));
        self.config.vehicle = Some(Vehicle {
            mass_kg: mass,
            yaw_inertia_kg_m2: inertia,
            half_track_m: half_track,
            steering: given.and_then(|v| v.steering),
            wheel_radius_m: radius,
            wheel_inertia_kg_m2: wheel_inertia,
            viscous_friction_n_m_s: viscous,
            torque_noise_n_m_sqrt_s: TORQUE_SHARE * torque * step_s.sqrt(),
            torque_constant_n_m_a: given.and_then(|v| v.torque_constant_n_m_a),
            load_kg: 0.0,
        });
        let [left, right] = &record.wheels_rad_s;
        self.config.encoder = Some(Encoder {
            speed_noise_std_rad_s: noise(left).max(noise(right)),
            ticks_per_revolution: self.init.and_then(|c| c.encoder).and_then(|e| e.ticks_per_revolution),
        });
        self.config.gyro = record.gyro_rad_s.as_ref().map(|readings| Gyro {
            c2_rad_s: told.bias_rad_s.unwrap_or(0.0),
            angle_random_walk_rad_sqrt_s: noise(readings) * step_s.sqrt(),
            ..Gyro::without_error(self.own.0)
        });
        self.config.pose = record.pose.as_ref().map(|[x, ..]| Pose {
            rate_hz: x.iter().filter(|v| v.is_finite()).count() as f64 / record.span_s().max(step_s),
            position_std_m: SIMULATED_POSE_STD[0],
            heading_std_rad: SIMULATED_POSE_STD[1],
            lever_arm_std_m: self.init.and_then(|c| c.pose).and_then(|p| p.lever_arm_std_m),
            heading_offset_std_rad: self.init.and_then(|c| c.pose).and_then(|p| p.heading_offset_std_rad),
            delay_std_s: None,
            correlation_time_s: self.init.and_then(|c| c.pose).and_then(|p| p.correlation_time_s),
        });
        Ok(())
    }

    /// The fit of the configuration so far, its effects beside it.
    fn fit(&mut self) -> Result<Fitting> {
        let bare = Config { effects: self.fixed.clone(), ..self.config.clone() };
        let clocks = clocks::agree(&bare, self.runs, &[])?;
        let [runs, _] = clocks.drives(self.runs, &[]);
        let record = Record::of_drives(&bare, &runs)?;
        for note in clocks.said.iter().chain(&clocks.notes) {
            if !self.notes.contains(note) {
                self.notes.push(note.clone());
            }
        }
        let (torques, gyro) = (record.torques_n_m.is_some(), record.gyro_rad_s.is_some());
        let pose = record.pose.is_some();
        let warming = self.config.gyro.as_ref().is_some_and(|g| g.c1_rad_s != 0.0);
        let tells = |c: &Constant| match c {
            Constant::Mass | Constant::Inertia | Constant::Viscous => torques,
            Constant::Track => gyro || pose,
            Constant::Radius => pose,
            Constant::RadiusRatio => gyro || pose,
            Constant::WarmUp => gyro && warming,
        };
        let free = Constant::ALL.into_iter().filter(tells).collect();
        let changes = self.held.iter().map(|h| (h.change, h.theta.clone())).collect();
        Ok(Fitting::new(record, self.own, free, changes))
    }

    /// The fit with a warm-up of the gyro, where that is worth two parameters (Schwarz's criterion); else as it was.
    fn warm(&mut self, mut fitting: Fitting) -> Fitting {
        if fitting.record.gyro_rad_s.is_none() {
            return fitting;
        }
        let plain = fitting.fit();
        let readings = fitting.record.gyro_rad_s.as_ref().map_or(0, |g| g.iter().filter(|v| v.is_finite()).count());
        let mut free = fitting.free.clone();
        free.push(Constant::WarmUp);
        let gain = |own: &'static Constants| {
            let mut tried = fitting.clone();
            tried.warm_with(own);
            tried.normal(&tried.record, &free, true).gain - plain.gain
        };
        let best = warming().iter().map(|own| (gain(own), own)).max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, own)) = best.filter(|b| b.0 > (readings.max(1) as f64).ln()) {
            self.own = own;
            fitting.warm_with(own);
            fitting.free = free;
        }
        fitting
    }

    /// Fits, and takes the constants over.
    fn settle(&mut self, fitting: &mut Fitting) -> Normal {
        let normal = fitting.fit();
        for (held, (_, theta)) in self.held.iter_mut().zip(&fitting.changes) {
            held.theta.clone_from(theta);
        }
        let belief = &fitting.record.belief;
        if let Some(v) = &mut self.config.vehicle {
            v.mass_kg = belief.robot.mass_kg;
            v.yaw_inertia_kg_m2 = belief.robot.yaw_inertia_kg_m2;
            v.half_track_m = belief.robot.half_track_m;
            v.wheel_radius_m = belief.robot.radius_m[0];
            v.viscous_friction_n_m_s = belief.robot.viscous_friction_n_m_s;
            v.torque_noise_n_m_sqrt_s = belief.torque_noise_n_m_sqrt_s;
        }
        let step_s = fitting.record.step_s;
        if let Some(e) = &mut self.config.encoder {
            let by_ticks = e.speed_variance_rad2_s2(step_s) - e.speed_noise_std_rad_s.powi(2);
            e.speed_noise_std_rad_s = (belief.wheel_std_rad_s.powi(2) - by_ticks).max(0.0).sqrt();
        }
        let turn_on = turn_ons(&normal, self.runs.len());
        if let Some(g) = &mut self.config.gyro {
            g.angle_random_walk_rad_sqrt_s = belief.gyro_std_rad_s * step_s.sqrt();
            g.c1_rad_s = belief.warm_up.c1_rad_s;
            g.time_constant_s = belief.warm_up.time_constant_s;
            let told = normal.told(Fitted::Constant(Constant::WarmUp));
            g.warm_up_relative_std = told.map(|[_, std]| APART.hypot(std / g.c1_rad_s));
            if let Some([mean, _, between]) = turn_on {
                g.c2_rad_s = belief.warm_up.c2_rad_s + mean;
                g.turn_on_bias_std_rad_s = (self.runs.len() > 1).then_some(between);
            }
        }
        if let Some(p) = &mut self.config.pose {
            (p.position_std_m, p.heading_std_rad) = (belief.position_std_m, belief.heading_std_rad);
        }
        let held =
            self.held.iter().map(|h| EffectTable { id: h.id.clone(), parameters: h.change.parameters(&h.theta) });
        self.config.effects = self.fixed.iter().cloned().chain(held).collect();
        normal
    }

    /// Takes in what `account` names and the twin can hold beside its constants and its noise, which are fitted anyway; whether there
    /// was any.
    fn take_in(&mut self, account: &Answer) -> bool {
        let mut any = false;
        let found = |id: &String| account.effects.iter().find(|e| e.id == *id);
        for found in account.together.iter().filter_map(found) {
            let Some(effect) = self.library.driving_by_id(&found.id) else { continue };
            any |= match effect.explanation() {
                DriveExplanation::Model(change) if change.lags().is_some() => {
                    add_up(&mut self.fixed, &found.id, &found.parameters);
                    true
                }
                DriveExplanation::WheelLattice => {
                    self.fixed.retain(|f| f.id != found.id);
                    self.fixed.push(EffectTable { id: found.id.clone(), parameters: found.parameters.clone() });
                    true
                }
                DriveExplanation::Model(change) if !self.is_constant(change, &found.parameters) => {
                    self.hold(effect, change, &found.parameters);
                    true
                }
                _ => false,
            };
        }
        any
    }

    /// Whether the effect is another value of constants that are fitted.
    fn is_constant(&self, change: &dyn ModelChange, parameters: &Parameters) -> bool {
        let Some(vehicle) = &self.config.vehicle else { return false };
        let nominal = Robot::from(vehicle);
        let mut robot = nominal;
        change.at(&change.theta(parameters)).robot(&mut robot);
        let alike = robot.radius_m[0] == robot.radius_m[1]
            && robot.torque_gain == nominal.torque_gain
            && robot.com_offset_m == nominal.com_offset_m;
        change.is_rigid() && robot != nominal && alike
    }

    fn hold(&mut self, effect: &'static dyn Driving, change: &'static dyn ModelChange, parameters: &Parameters) {
        let id = effect.about().id;
        let mut theta = change.theta(parameters);
        theta.resize(change.coordinates().len() + change.departures().len(), 0.0);
        match self.held.iter_mut().find(|h| h.id == id) {
            Some(held) => held.theta.iter_mut().zip(theta).for_each(|(own, more)| *own += more),
            None => self.held.push(Held { id: id.into(), change, theta }),
        }
    }

    fn told(self, fitting: Fitting, normal: &Normal, account: Answer) -> Twin {
        let given =
            if self.init.is_some_and(|c| c.vehicle.is_some()) { Provenance::Given } else { Provenance::Convention };
        let parameters = parameters(&self.config, &fitting, normal, given, self.runs.len());
        let place = |id: &str| self.held.iter().position(|h| h.id == id);
        let effects = self.config.effects.iter().map(|e| {
            let std = place(&e.id).map_or_else(Parameters::new, |i| {
                let held = &self.held[i];
                let stds: Vec<f64> =
                    (0..held.theta.len()).map(|j| normal.told(Fitted::Change(i, j)).map_or(0.0, |t| t[1])).collect();
                moved(held.change, &held.theta, &stds)
            });
            let of_account = account.effects.iter().find(|a| a.id == e.id).map(|a| a.std.clone());
            let std = if std.is_empty() { of_account.unwrap_or_default() } else { std };
            TwinEffect { id: e.id.clone(), parameters: e.parameters.clone(), std, in_twin: true }
        });
        // what no nominal simulator can hold, or constants and noise do not take up
        let left = account.together.iter().filter(|id| self.config.effects.iter().all(|e| e.id != **id));
        let left = left.filter_map(|id| account.effects.iter().find(|e| e.id == *id)).map(|e| TwinEffect {
            id: e.id.clone(),
            parameters: e.parameters.clone(),
            std: e.std.clone(),
            in_twin: false,
        });
        let effects = effects.chain(left).collect();
        let mut notes = self.notes.clone();
        notes.extend(fitting.record.notes.iter().cloned());
        if self.init.and_then(|c| c.vehicle).is_none() && fitting.record.torques_n_m.is_none() {
            notes.push(
                "Without torques nothing tells mass and yaw inertia, and nothing here depends on them: 1 kg and 1 kg m2 are entered. Give \
                 the true ones with --init before the twin is used for anything else."
                    .into(),
            );
        } else if self.init.and_then(|c| c.vehicle).is_none() {
            notes.push(
                "The wheels' inertia cannot be told from the mass that they move with: mass and yaw inertia hold it. Give it with --init to \
                 have them apart."
                    .into(),
            );
        }
        if self.runs.len() == 1 && self.config.gyro.is_some() {
            notes.push("One run of the simulator does not tell how its gyro's bias varies from run to run.".into());
        }
        let horizons = account.gap.iter().filter(|m| m.metric.contains("rms")).cloned().collect();
        let forms = account.free_forms.iter().filter(|f| f.probability > 0.5).map(|f| f.id.clone()).collect();
        Twin {
            parameters,
            channels: channels(&fitting, normal),
            horizons,
            effects,
            left: Some(account.verdict),
            remainder: account.remainder.clone().filter(|_| account.verdict != Verdict::None),
            free_forms: forms,
            runs: self.runs.len(),
            notes,
            config: self.config,
            account: Some(account),
            fitting: Some(fitting),
        }
    }
}

fn add_up(tables: &mut Vec<EffectTable>, id: &str, parameters: &Parameters) {
    match tables.iter_mut().find(|t| t.id == id) {
        Some(table) => {
            for (name, value) in parameters {
                *table.parameters.entry(name.clone()).or_insert(0.0) += value;
            }
        }
        None => tables.push(EffectTable { id: id.into(), parameters: parameters.clone() }),
    }
}

/// A configuration of a robot of unit size, to read a log by; its steering, ticks and pose are those of `init`.
fn placeholder(init: Option<&Config>, step_s: f64) -> Config {
    let given = init.and_then(|c| c.vehicle);
    Config {
        schema: crate::config::SCHEMA,
        kind: Kind::Driving,
        sample_time_s: Some(step_s),
        gyro: Some(Gyro::without_error(1.0)),
        vehicle: Some(given.unwrap_or(Vehicle {
            mass_kg: 1.0,
            yaw_inertia_kg_m2: 1.0,
            half_track_m: 1.0,
            steering: None,
            wheel_radius_m: 1.0,
            wheel_inertia_kg_m2: 0.0,
            viscous_friction_n_m_s: 0.0,
            torque_noise_n_m_sqrt_s: 0.0,
            torque_constant_n_m_a: None,
            load_kg: 0.0,
        })),
        traction: None,
        encoder: Some(Encoder {
            speed_noise_std_rad_s: 1.0,
            ticks_per_revolution: init.and_then(|c| c.encoder).and_then(|e| e.ticks_per_revolution),
        }),
        pose: None,
        effects: Vec::new(),
        custom_effects: init.map(|c| c.custom_effects.clone()).unwrap_or_default(),
        validation: None,
        provenance: None,
    }
}
