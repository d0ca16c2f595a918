//! `gyroid simulate` with the effects of `[[effect]]`, as a user runs it.

use crate::place::Place;
use gyroid::effects::registry;
use gyroid::ingest::read_log;
use gyroid::signal::names;

const REST: &str = "schema = 1\nkind = \"stationary\"\nsample_time_s = 0.05\n\
    [gyro]\nc1_rad_s = 1e-3\nc2_rad_s = -2e-3\ntime_constant_s = 120.0\nangle_random_walk_rad_sqrt_s = 1e-4\n";

fn rates(place: &Place, name: &str) -> Vec<f64> {
    read_log(place.path(name)).unwrap().get(names::GYRO_Z).unwrap().to_vec()
}

fn hold() -> String {
    let row = |i: i32| {
        let t = 0.05 * f64::from(i);
        format!("{t},{},{},{}\n", 1e-3 * t.sin(), 25.0 + 0.02 * t, 5.0 + 0.1 * (0.3 * t).sin())
    };
    let rows: String = (0..2000).map(row).collect();
    format!("t_s,gyro_z_rad_s,temperature_c,supply_v\n{rows}")
}

#[test]
fn an_augmented_simulator_predicts_a_recording_row_by_row() {
    let place = Place::with(&[]);
    place.write("hold.csv", &hold());
    place.write("nominal.toml", REST);
    let effects = "[[effect]]\nid = \"gyro.temperature_sensitivity\"\ncoefficient_rad_s_per_c = 1e-3\n\
        [[effect]]\nid = \"gyro.supply_sensitivity\"\ncoefficient_rad_s_per_v = 2e-2\n";
    place.write("augmented.toml", &format!("{REST}{effects}"));
    let text = place.ok("simulate augmented.toml --inputs hold.csv --seed 1 -o predicted.parquet");
    assert!(text.contains("gyro.temperature_sensitivity, gyro.supply_sensitivity"), "{text}");
    place.ok("simulate augmented.toml --inputs hold.csv --seed 1 -o again.parquet");
    place.ok("simulate nominal.toml --inputs hold.csv --seed 1 -o nominal.parquet");

    let file = |name: &str| std::fs::read(place.path(name)).unwrap();
    assert_eq!(file("predicted.parquet"), file("again.parquet"));
    let recorded = read_log(place.path("hold.csv")).unwrap();
    let predicted = read_log(place.path("predicted.parquet")).unwrap();
    assert_eq!(predicted.time, recorded.time);
    for name in [names::TEMPERATURE, names::SUPPLY] {
        assert_eq!(predicted.get(name), recorded.get(name), "{name}");
    }
    // the same white noise: what is left is the two effects, up to the constant of the first second and of the mean
    let (with, without) = (rates(&place, "predicted.parquet"), rates(&place, "nominal.parquet"));
    let (temperature, supply) = (recorded.get(names::TEMPERATURE).unwrap(), recorded.get(names::SUPPLY).unwrap());
    let told = |i: usize| 1e-3 * temperature[i] + 2e-2 * supply[i];
    for i in 0..with.len() {
        let (gap, expected) = (with[i] - without[i], told(i) - told(0));
        assert!((gap - expected - (with[0] - without[0])).abs() < 1e-12, "row {i}: {gap} {expected}");
    }
}

#[test]
fn every_effect_runs_from_the_command_line() {
    let place = Place::with(&[]);
    place.write("hold.csv", &hold());
    place.write("nominal.toml", REST);
    place.ok("simulate nominal.toml --inputs hold.csv --seed 2 -o nominal.parquet");
    let nominal = rates(&place, "nominal.parquet");
    for effect in registry() {
        let about = effect.about();
        let mut text = format!("{REST}[[effect]]\nid = \"{}\"\n", about.id);
        for p in about.parameters.iter().filter(|p| p.required || about.id == "gyro.noise_growth") {
            // well inside the bounds
            let value = p.bounds[1].min(0.1);
            text += &format!("{} = {value:?}\n", p.name);
        }
        place.write("one.toml", &text);
        place.ok("simulate one.toml --inputs hold.csv --seed 2 -o one.parquet");
        let changed = rates(&place, "one.parquet");
        assert_eq!(changed.len(), nominal.len());
        assert!(changed.iter().zip(&nominal).any(|(a, b)| (a - b).abs() > 1e-6), "{} changes nothing", about.id);
    }
}

#[test]
fn what_cannot_be_simulated_is_named() {
    let place = Place::with(&[]);
    place.write("hold.csv", &hold());
    let with = |table: &str| place.write("one.toml", &format!("{REST}[[effect]]\n{table}\n"));
    with("id = \"gyro.temperature_sensitivity\"\ncoefficient_rad_s_per_c = 1e-3");
    place.refused("simulate one.toml --duration 60 -o x.csv", 1, &["one.toml", "temperature_c", "--inputs LOG"]);
    with("id = \"gyro.tone\"\nfrequency_hz = 3.0");
    place.refused("simulate one.toml --duration 60 -o x.csv", 1, &["gyro.tone.amplitude_rad_s", "missing"]);
    with("id = \"gyro.tone\"\nfrequency_hz = 3.0\nloudness = 1.0");
    place.refused("simulate one.toml --inputs hold.csv -o x.csv", 1, &["loudness", "amplitude_rad_s, phase_rad"]);
    with("id = \"gyro.tune\"");
    place.refused("simulate one.toml --duration 60 -o x.csv", 1, &["gyro.tune", "gyro.tone"]);
    assert!(!place.path("x.csv").exists());
}

const ROBOT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.01\n\
    [gyro]\nc1_rad_s = 1e-3\nc2_rad_s = -2e-3\ntime_constant_s = 120.0\nangle_random_walk_rad_sqrt_s = 1e-4\n\
    [vehicle]\nmass_kg = 9.5\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\nwheel_radius_m = 0.05\n\
    wheel_inertia_kg_m2 = 0.0008\nviscous_friction_n_m_s = 0.0006\ntorque_noise_n_m_sqrt_s = 0.0004\n\
    [encoder]\nspeed_noise_std_rad_s = 0.02\n[pose]\nrate_hz = 5.0\nposition_std_m = 0.002\nheading_std_rad = 0.002\n";

#[test]
fn drives_with_effects_follow_courses_and_replay_logs() {
    let p = Place::with(&[]);
    p.write("robot.toml", ROBOT);
    let slow = "[[effect]]\nid = \"gyro.scale_factor\"\nrelative = 0.5\n[[effect]]\nid = \"gyro.rate_ramp\"\nramp_rad_s2 = 1e-7\n";
    p.write("augmented.toml", &format!("{ROBOT}{slow}[[effect]]\nid = \"vehicle.payload\"\nmass_relative = 0.3\n"));
    p.ok("simulate robot.toml --course square --duration 20 -o hold.parquet");
    let text = p.ok("simulate augmented.toml --inputs hold.parquet --seed 1 -o predicted.parquet");
    assert!(text.contains("gyro.scale_factor, gyro.rate_ramp, vehicle.payload"), "{text}");
    p.ok("simulate augmented.toml --inputs hold.parquet --seed 1 -o again.parquet");
    assert_eq!(rates(&p, "predicted.parquet"), rates(&p, "again.parquet"));
    p.ok("simulate robot.toml --inputs hold.parquet --seed 1 -o nominal.parquet");
    // what the gyro says it has turned over what the pose says
    let ratio = |name: &str| {
        let log = read_log(p.path(name)).unwrap();
        let gyro: f64 = log.get(names::GYRO_Z).unwrap().iter().map(|w| 0.01 * w).sum();
        let heading: Vec<f64> = log.get(names::HEADING).unwrap().iter().copied().filter(|h| h.is_finite()).collect();
        let turned = heading[heading.len() - 1] - heading[0];
        assert!(turned > 1.0, "{name}: {turned}");
        (gyro / turned, turned)
    };
    p.ok("simulate augmented.toml --course square --duration 20 -o course.parquet");
    for (name, gain) in [("nominal.parquet", 1.0), ("predicted.parquet", 1.5), ("course.parquet", 1.5)] {
        // the bias of 2e-3 rad/s makes 0.04 rad in 20 s
        assert!((ratio(name).0 - gain).abs() < 0.04, "{name}: {:?}", ratio(name));
    }
    // the loaded robot turns less for the same torques, and keeps to its course where it is steered
    assert!(ratio("predicted.parquet").1 < 0.9 * ratio("nominal.parquet").1);
    assert!((ratio("course.parquet").1 - ratio("hold.parquet").1).abs() < 0.3);

    p.write("slope.toml", &format!("{ROBOT}[[effect]]\nid = \"ground.slope\"\nslope_rad = 0.1\n"));
    p.refused("simulate slope.toml --course square -o x.csv", 1, &["slope.toml", "uphill_heading_rad", "missing"]);
    p.write("unheard.toml", &format!("{ROBOT}[[effect]]\nid = \"wheel.unheard_of\"\n"));
    p.refused(
        "simulate unheard.toml --inputs hold.parquet -o x.csv",
        1,
        &["wheel.unheard_of", "gyro.tone", "wheel.slip"],
    );
    // the filter takes these effects, which the nominal robot has not, and refuses by name what it cannot
    p.unfit("navigate augmented.toml hold.parquet -o x.csv");
    p.write("bandwidth.toml", &format!("{ROBOT}[[effect]]\nid = \"gyro.bandwidth\"\ncutoff_hz = 5.0\n"));
    p.refused("navigate bandwidth.toml hold.parquet -o y.csv", 1, &["gyro.bandwidth", "the filter cannot take it"]);
    p.write("rest.toml", &format!("{REST}[[effect]]\nid = \"wheel.lateral_skid\"\nlateral_slip_s = 0.1\n"));
    p.refused("simulate rest.toml -o y.csv", 1, &["wheel.lateral_skid", "effect of drives", "at rest"]);
}
