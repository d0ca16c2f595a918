use super::*;
use crate::effects::drive::{ids, registry};

const CONFIG: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.01\n\
    [gyro]\nc1_rad_s = 0.0\nc2_rad_s = 0.0\ntime_constant_s = 200.0\nangle_random_walk_rad_sqrt_s = 1.8e-4\n\
    [vehicle]\nmass_kg = 12.0\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\nwheel_radius_m = 0.065\n\
    wheel_inertia_kg_m2 = 0.00133\nviscous_friction_n_m_s = 0.004\ntorque_noise_n_m_sqrt_s = 0.001\n\
    [encoder]\nspeed_noise_std_rad_s = 0.02\n";

fn found(id: &str, parameters: &[(&str, f64, f64)]) -> EffectAnswer {
    let named = |value: fn(&(&str, f64, f64)) -> f64| parameters.iter().map(|p| (p.0.to_string(), value(p))).collect();
    EffectAnswer { parameters: named(|p| p.1), std: named(|p| p.2), ..EffectAnswer::new(id, 0.99) }
}

fn of(effects: &[&EffectAnswer], chassis: Option<&Chassis>) -> Ranges {
    ranges(effects, &Config::parse(CONFIG, "robot.toml").unwrap(), chassis)
}

#[track_caller]
fn near(found: &Value, wanted: f64) {
    let found = found.as_f64().unwrap();
    assert!((found - wanted).abs() < 1e-9 * wanted.abs().max(1.0), "{found} for {wanted}");
}

fn chassis() -> Chassis {
    Chassis { name: "base".into(), mass_kg: 11.1, wheels_a_side: 2 }
}

#[test]
fn a_load_adds_kilograms_and_its_centre_moves_that_of_the_chassis() {
    let load = found(ids::payload(), &[("mass_relative", 0.2, 0.01), ("inertia_relative", 0.3, 0.02)]);
    let ahead = found("vehicle.com_offset", &[("offset_m", 0.04, 0.001)]);
    let both = of(&[&load, &ahead], Some(&chassis()));
    let [mass, com] = &both.events[..] else { panic!("{both:?}") };
    assert_eq!((mass.func, com.func), ("randomize_rigid_body_mass", "randomize_rigid_body_com"));
    let range = &mass.params["mass_distribution_params"];
    near(&range[0], 12.0 * (0.2 - 1.96 * 0.01));
    near(&range[1], 12.0 * (0.2 + 1.96 * 0.01));
    near(&mass.mean["mass_distribution_params"], 2.4);
    assert_eq!(mass.params["asset_cfg"]["body_names"], "base");
    // 0.2 is nearer to 0.3 than none
    assert_eq!((&mass.params["operation"], &mass.params["recompute_inertia"]), (&json!("add"), &json!(true)));
    near(&com.mean["com_range"]["x"], 0.04 * 14.4 / 13.5);
    near(&com.params["com_range"]["x"][1], (0.04 + 1.96 * 0.001) * 14.4 / 13.5);
    // nobody said what the chassis weighs: all that is loaded moves
    near(&of(&[&load, &ahead], None).events[1].mean["com_range"]["x"], 0.04);
    let alone = of(&[&ahead], None);
    near(&alone.events[0].mean["com_range"]["x"], 0.04);
    assert!(alone.events[0].note.is_some() && alone.notes.iter().any(|n| n.contains("<chassis>")), "{alone:?}");
}

#[test]
fn a_tilted_floor_is_a_gravity_whose_spread_is_that_of_both_angles() {
    let slope = found("ground.slope", &[("slope_rad", 0.05, 0.002), ("uphill_heading_rad", 0.8, 0.04)]);
    let found = of(&[&slope], None);
    let [event] = &found.events[..] else { panic!("{found:?}") };
    assert_eq!((event.func, &event.params["operation"]), ("randomize_physics_scene_gravity", &json!("abs")));
    let g = GRAVITY_M_S2;
    near(&event.mean["gravity_distribution_params"][2], -g * 0.05f64.cos());
    let params = &event.params["gravity_distribution_params"];
    let half = |i: usize| 0.5 * (params[1][i].as_f64().unwrap() - params[0][i].as_f64().unwrap());
    // derivatives by hand
    let std = g * (0.05f64.cos() * 0.8f64.cos() * 0.002).hypot(0.05f64.sin() * 0.8f64.sin() * 0.04);
    assert!((half(0) / (1.96 * std) - 1.0).abs() < 1e-3, "{} for {std}", half(0));
    assert!((half(2) / (1.96 * g * 0.05f64.sin() * 0.002) - 1.0).abs() < 1e-3);
}

#[test]
fn what_no_event_does_is_said_with_numbers_for_another_way() {
    let rolling = found("wheel.rolling_resistance", &[("coefficient", 0.02, 0.001), ("rise_s_per_m", 0.01, 0.0)]);
    let wheel = found(ids::radius_right(), &[("relative", -0.02, 0.001)]);
    let slip = found(ids::slip(), &[("compliance", 0.1, 0.01)]);
    let out = of(&[&rolling, &wheel, &slip], Some(&chassis()));
    assert!(out.events.is_empty() && out.observations.is_empty());
    let [rolling, wheel, slip] = &out.no_place[..] else { panic!("{out:?}") };
    // a quarter of the weight on each of four wheels
    let load = 12.0 * GRAVITY_M_S2 / 4.0;
    near(&json!(rolling.instead["friction"].mean), (0.02 - 0.005) * load * 0.065);
    near(&json!(rolling.instead["friction"].ci95[1]), (0.02 - 0.005 + 1.96 * 0.001) * load * 0.065);
    near(&json!(rolling.instead["viscous_friction"].mean), 0.01 * load * 0.065 * 0.065);
    near(&json!(wheel.instead["right_over_described"].mean), 0.98);
    assert!(slip.instead.is_empty() && slip.why.contains("how the robot moves"));
}

#[test]
fn sensors_are_observations_and_noise_is_of_one_reading() {
    let late = found(ids::gyro_delay(), &[("delay_s", 0.03, 0.001)]);
    let loud = found(ids::gyro_noise(), &[("noise_over_nominal", 2.0, 0.05)]);
    let out = of(&[&late, &loud], None);
    let [late, loud] = &out.observations[..] else { panic!("{out:?}") };
    assert!(late.goes_to.contains("DelayBuffer") && late.std.is_none() && late.channels == [names::GYRO_Z]);
    assert_eq!(late.parameters["delay_s"], Range { mean: 0.03, ci95: [0.03 - 1.96 * 0.001, 0.03 + 1.96 * 0.001] });
    let std = loud.std.as_ref().unwrap()[names::GYRO_Z];
    near(&json!(std.mean), 2.0 * 1.8e-4 / 0.1);
}

#[test]
fn every_effect_is_somewhere() {
    for effect in registry() {
        let tried = effect.tried().parameters();
        let effect =
            found(effect.about().id, &tried.iter().map(|(n, v)| (n.as_str(), *v, 0.01 * v)).collect::<Vec<_>>());
        let out = of(&[&effect], None);
        let told = out.events.len() + out.observations.len() + out.no_place.len();
        assert_eq!(told, 1, "{} {out:?}", effect.id);
    }
}
