use super::*;
use crate::config::Config;
use crate::effects::{Effect, Library};
use crate::model::EffectSource;
use crate::model::drive::DriveModel;
use crate::simulate::{Course, Options, drive_with};

const ROBOT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.01\n[vehicle]\nmass_kg = 9.5\nyaw_inertia_kg_m2 = 0.21\n\
    half_track_m = 0.17\nwheel_radius_m = 0.05\nwheel_inertia_kg_m2 = 0.0008\nviscous_friction_n_m_s = 0.0006\n\
    torque_noise_n_m_sqrt_s = 0.0004\n[encoder]\nspeed_noise_std_rad_s = 0.02\n[gyro]\nc1_rad_s = 0.0\nc2_rad_s = 0.0\n\
    time_constant_s = 300.0\nangle_random_walk_rad_sqrt_s = 1e-4\n[pose]\nrate_hz = 10.0\nposition_std_m = 0.002\n\
    heading_std_rad = 0.002\n";

/// A table that acts on `place`, its parameters with null values, or with plausible ranges alone.
fn table(id: &str, place: &str, expression: &str, sizes: &[&str], shape: &[(&str, [f64; 2])]) -> String {
    let head = format!(
        "[[custom_effect]]\nid = \"{id}\"\ntitle = \"{id}\"\nacts_on = \"{place}\"\nexpression = \"{expression}\"\n"
    );
    let one = |name: &str, more: String| {
        format!("[[custom_effect.parameter]]\nname = \"{name}\"\nunit = \"-\"\nmeaning = \"-\"\n{more}")
    };
    let sizes =
        sizes.iter().map(|name| one(name, "bounds = [0.0, 90.0]\nnull = 0.0\nplausible = [0.1, 40.0]\n".into()));
    let shape = shape
        .iter()
        .map(|(name, [low, high])| one(name, format!("bounds = [-50.0, 50.0]\nplausible = [{low:?}, {high:?}]\n")));
    [head].into_iter().chain(shape).chain(sizes).collect()
}

fn config(own: &[String], effects: &str) -> Config {
    Config::parse(&format!("{ROBOT}{}{effects}", own.concat()), "sim.toml").unwrap()
}

const TETHER: &str = "stiffness*max(0, 1 - free_m/sqrt((1.5 - x_m)^2 + (0.5 - y_m)^2 + 1e-6))\
    *((1.5 - x_m)*cos(heading_rad) + (0.5 - y_m)*sin(heading_rad))";

fn tether() -> String {
    table("custom.tether", "force_n", TETHER, &["stiffness"], &[("free_m", [0.2, 3.0])])
}

fn effect(of: &Config) -> &'static dyn Driving {
    Library::new().with_own(of).unwrap().driving_by_id(&of.custom_effects[0].id).unwrap()
}

/// One that moves in every way.
fn moving() -> Moving<'static> {
    Moving {
        t_s: 1.0,
        since_power_on_s: 9.0,
        x_m: 3.0,
        y_m: -1.2,
        heading_rad: 0.7,
        speed_m_s: 0.4,
        yaw_rate_rad_s: -0.6,
        acceleration_m_s2: 0.3,
        yaw_acceleration_rad_s2: 1.1,
        wheel_force_n: [2.0, -3.0],
        past: None,
    }
}

#[test]
fn it_acts_where_it_says_and_nowhere_else() {
    let vehicle = config(&[], "").vehicle.unwrap();
    let nominal = DriveModel::new(Robot::from(&vehicle), Vec::new());
    let (r, b) = (vehicle.wheel_radius_m, vehicle.half_track_m);
    for (place, by, force, readings) in [
        ("force_n", 2.0 * 0.4, [0.8, 0.0], [0.0; 3]),
        ("torque_n_m", 2.0 * 0.4, [0.0, 0.8], [0.0; 3]),
        ("wheel_left_torque_n_m", 2.0 * 0.4, [0.8 / r, -b * 0.8 / r], [0.0; 3]),
        ("wheel_right_torque_n_m", 2.0 * 0.4, [0.8 / r, b * 0.8 / r], [0.0; 3]),
        ("wheel_left_rad_s", 2.0 * 0.4, [0.0; 2], [0.8, 0.0, 0.0]),
        ("wheel_right_rad_s", 2.0 * 0.4, [0.0; 2], [0.0, 0.8, 0.0]),
        ("gyro_rate_rad_s", 2.0 * 0.4, [0.0; 2], [0.0, 0.0, 0.8]),
    ] {
        let config = config(&[table("custom.one", place, "k*speed_m_s", &["k"], &[])], "");
        let effect = effect(&config);
        let change = effect.change().unwrap();
        let work = effect.simulated(&Parameters::from([("k".into(), 2.0)]), 60.0, 1).unwrap();
        let (robot, at) = (Robot::from(&vehicle), moving());
        let near = |found: &[f64], wanted: &[f64]| found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!((by - 0.8f64).abs() < 1e-12 && near(&work.force(&robot, &at), &force), "{place}");
        let model = DriveModel::new(robot, vec![work]);
        let ([l, r], [l0, r0]) = (model.wheels_rad_s(&at), nominal.wheels_rad_s(&at));
        let gyro = model.gyro_rad_s(&at) - nominal.gyro_rad_s(&at);
        assert!(near(&[l - l0, r - r0, gyro], &readings), "{place}");
        let Touches { motion, wheels, gyro, pose } = change.touches();
        let moved = [force != [0.0; 2], readings[0] + readings[1] != 0.0, readings[2] != 0.0, false];
        assert_eq!([motion, wheels, gyro, pose], moved, "{place}");
        // nothing but a force needs torques to be known
        let needs = change.needs();
        assert_eq!((needs.torques, needs.gyro, needs.pose), (motion, gyro, false), "{place}");
        assert!(change.is_rigid() && change.positive() == 1 && change.starts().is_empty());
    }
}

#[test]
fn readings_that_follow_forces_need_torques() {
    let own = table("custom.rim", "wheel_left_rad_s", "k*wheel_left_force_n", &["k"], &[]);
    let config = config(&[own], "");
    let effect = effect(&config);
    assert!(effect.change().unwrap().needs().torques);
    assert_eq!((effect.about().condition, effect.about().channel), (Some("torque"), "wheel_left"));
    let model = DriveModel::new(Robot::from(&config.vehicle.unwrap()), vec![effect.change().unwrap().at(&[0.25])]);
    let rolling = model.robot.wheels_rad_s(0.4, -0.6)[0];
    assert!((model.wheels_rad_s(&moving())[0] - rolling - 0.5).abs() < 1e-12);
}

#[test]
fn every_signal_of_every_place_has_a_quantity() {
    for place in ["force_n", "torque_n_m", "wheel_left_rad_s", "wheel_right_rad_s", "gyro_rate_rad_s"] {
        let config = config(&[table("custom.one", place, "k", &["k"], &[])], "");
        let signals = config.custom_effects[0].acts_on.signals();
        let (at, robot) = (moving(), Robot::from(&config.vehicle.unwrap()));
        for signal in signals {
            let own = table("custom.one", place, &format!("k*{}", signal.name), &["k"], &[]);
            let config = self::config(&[own], "");
            let model = DriveModel::new(robot, vec![effect(&config).change().unwrap().at(&[1.0])]);
            let mut there = at;
            model.accelerate(&mut there, [0.0; 2]);
            let [l, r] = model.wheels_rad_s(&at);
            let all = [there.acceleration_m_s2, there.yaw_acceleration_rad_s2, l, r, model.gyro_rad_s(&at)];
            assert!(all.iter().all(|v| v.is_finite()), "{place} {}: {all:?}", signal.name);
        }
    }
}

#[test]
fn a_tether_pulls_to_where_it_is_fixed_and_says_that_it_follows_the_place() {
    let config = config(&[tether()], "");
    let effect = effect(&config);
    let change = effect.change().unwrap();
    let size = Parameters::from([("stiffness".into(), 8.0), ("free_m".into(), 0.9)]);
    let work = effect.simulated(&size, 60.0, 1).unwrap();
    let (robot, at) = (Robot::small(), moving());
    // by hand
    let (dx, dy) = (1.5 - at.x_m, 0.5 - at.y_m);
    let far = f64::hypot(dx, dy);
    let along = (dx * at.heading_rad.cos() + dy * at.heading_rad.sin()) / far;
    let wanted = 8.0 * (far - 0.9) * along;
    let force = |at: &Moving| work.force(&robot, at)[0];
    assert!((force(&at) - wanted).abs() < 1e-5 * wanted.abs(), "{} {wanted}", force(&at));
    assert_eq!(force(&Moving { x_m: 1.2, y_m: 0.1, ..at }), 0.0, "slack");
    let follows = work.force_follows();
    assert!(follows.position && follows.heading && !follows.speeds && !follows.accelerations);
    assert!(DriveModel::new(robot, vec![effect.simulated(&size, 60.0, 1).unwrap()]).follows_position);
    // the size first, whatever the order of the tables; θ = 0 is the effect without size, of plausible shape
    let theta = change.theta(&size);
    assert!((theta[0] - 8.0).abs() < 1e-12 && (theta[1] - (0.9 - (0.2f64 * 3.0).sqrt())).abs() < 1e-12, "{theta:?}");
    let again = change.parameters(&theta);
    assert!(size.iter().all(|(name, v)| (again[name] - v).abs() < 1e-12), "{again:?}");
    assert_eq!(change.at(&[0.0, 0.0]).force(&robot, &at), [0.0; 2]);
    assert!(!change.is_rigid() && change.needs().torques && change.needs().pose);
    // derivatives by the coordinates
    for j in 0..2 {
        let moved = |by: f64| {
            let mut there = theta.clone();
            there[j] += by;
            change.at(&there).force(&robot, &at)[0]
        };
        let slope = (moved(1e-5) - moved(-1e-5)) / 2e-5;
        let by_hand = [(far - 0.9) * along, -8.0 * along][j];
        assert!((slope - by_hand).abs() < 1e-4 * by_hand.abs(), "{j}: {slope} {by_hand}");
    }
}

#[test]
fn fits_begin_inside_what_is_plausible() {
    let own = table(
        "custom.t",
        "force_n",
        "k*exp(-((x_m - a)/3)^2 - ((y_m - c)/2)^2)",
        &["k"],
        &[("a", [-4.0, 2.0]), ("c", [1.0, 3.0])],
    );
    let config = config(&[own], "");
    let change = effect(&config).change().unwrap();
    let starts = change.starts();
    assert_eq!(starts.len(), STARTS);
    for theta in &starts {
        let at = change.parameters(theta);
        assert!((0.1..=40.0 + 1e-9).contains(&at["k"]) && (-4.0..=2.0).contains(&at["a"]), "{at:?}");
        assert!((1.0..=3.0).contains(&at["c"]), "{at:?}");
    }
    // each shape with every size, and no shape twice
    let mut shapes: Vec<u64> = starts.iter().map(|t| t[1].to_bits()).collect();
    shapes.dedup();
    assert_eq!(shapes.len(), STARTS / SIZES);
}

/// The tread of both wheels, as torques against their turning.
#[test]
fn rolling_resistance_written_as_ones_own_is_the_librarys() {
    const C: f64 = 0.02;
    let listed = crate::effects::drive::registry().iter().find(|e| e.about().title == "rolling resistance").unwrap();
    let law = |side: &str| format!("-c*4.903325*9.5*0.05*tanh(0.05*wheel_{side}_rad_s/0.002)");
    let own = [("left", "custom.l"), ("right", "custom.r")]
        .map(|(side, id)| table(id, &format!("wheel_{side}_torque_n_m"), &law(side), &["c"], &[]));
    let tables = |ids: &[&str], name: &str| -> String {
        ids.iter().map(|id| format!("[[effect]]\nid = \"{id}\"\n{name} = {C}\n")).collect()
    };
    let built_in = config(&[], &tables(&[listed.about().id], "coefficient"));
    let written = config(&own, &tables(&["custom.l", "custom.r"], "c"));
    let driven = |config: &Config| {
        let library = Library::new().with_own(config).unwrap();
        drive_with(config, Course::Square, 12.0, &Options::from(4), &library).unwrap()
    };
    let (one, other) = (driven(&built_in), driven(&written));
    let nominal = driven(&config(&[], ""));
    for channel in &one.truth.channels {
        let (name, values) = (channel.name.as_str(), &channel.values);
        let apart = |to: &[f64]| values.iter().zip(to).fold(0.0f64, |most, (a, b)| most.max((a - b).abs()));
        let own = apart(other.truth.require(name).unwrap());
        assert!(own < 1e-9, "{name}: {own}");
        let none = apart(nominal.truth.require(name).unwrap());
        assert!(none > 1e-4 || name.contains("gyro"), "{name}: {none}");
    }
}

#[test]
fn it_is_of_drives_alone_and_checked_as_the_librarys_are() {
    let config = config(&[tether()], "");
    let library = Library::new().with_own(&config).unwrap();
    let id = "custom.tether";
    assert!(library.is_of_drives(id) && library.by_id(id).is_none() && library.acts_through(id).torques);
    assert!(Library::new().driving_by_id(id).is_none());
    let at_rest: Vec<&dyn Effect> = library.effects().filter(|e| e.about().id == id).collect();
    assert!(at_rest.is_empty());
    assert!(crate::effects::about(id).unwrap().equation.starts_with("F = stiffness*max("));
    let made = |pairs: &[(&str, f64)]| {
        let parameters = pairs.iter().map(|(name, v)| ((*name).to_owned(), *v)).collect();
        library.drive_effect(id, &parameters, 60.0, 1).err().map(|e| e.to_string())
    };
    assert_eq!(made(&[("stiffness", 4.0), ("free_m", 1.0)]), None);
    assert!(made(&[("stiffness", 4.0)]).unwrap().contains("free_m"));
    assert!(made(&[("stiffness", -4.0), ("free_m", 1.0)]).unwrap().contains("not physical"));
    let without = Library::without([id]).with_own(&config).unwrap();
    assert!(without.driving_by_id(id).is_none());
}
