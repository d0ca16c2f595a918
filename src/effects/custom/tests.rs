use super::*;
use crate::bias::WarmUp;
use crate::config::Config;
use crate::effects::{Explanation, Library, Parameters};
use crate::model::{EffectSource, Scene};
use crate::signal::TimeAxis;

const REST: &str = "schema = 1\nkind = \"stationary\"\nsample_time_s = 0.5\n[gyro]\nc1_rad_s = 0.0\nc2_rad_s = 0.0\n\
    time_constant_s = 300.0\nangle_random_walk_rad_sqrt_s = 1e-4\n";

/// A regulator that drops out below a supply.
const DROPOUT: &str = "[[custom_effect]]\nid = \"custom.dropout\"\ntitle = \"regulator drops out\"\n\
    acts_on = \"gyro_bias_rad_s\"\nexpression = \"slope*max(0, dropout_v - supply_v)\"\n\
    [[custom_effect.parameter]]\nname = \"slope\"\nunit = \"rad/s per V\"\nbounds = [-1.0, 1.0]\nnull = 0.0\n\
    plausible = [1e-5, 0.1]\nmeaning = \"k\"\n\
    [[custom_effect.parameter]]\nname = \"dropout_v\"\nunit = \"V\"\nbounds = [0.0, 60.0]\nplausible = [3.2, 3.8]\n\
    meaning = \"where it begins\"\n";

fn library() -> Library {
    Library::new().with_own(&Config::parse(&format!("{REST}{DROPOUT}"), "sim.toml").unwrap()).unwrap()
}

fn scene(supply_v: Option<Vec<f64>>) -> Scene {
    Scene {
        time: TimeAxis::Uniform { start_s: 2.0, step_s: 0.5, len: 200 },
        step_s: 0.5,
        temperature_c: None,
        power_on_temperature_c: None,
        supply_v,
        warm_up: WarmUp { c1_rad_s: 0.0, c2_rad_s: 0.0, time_constant_s: 300.0 },
        white_std_rad_s: 1e-4,
        turn_on_bias_std_rad_s: 0.0,
        warm_up_relative_std: 0.0,
    }
}

fn falling() -> Option<Vec<f64>> {
    Some((0..200).map(|i| 4.2 - 0.006 * f64::from(i)).collect())
}

#[test]
fn what_is_simulated_is_what_explains() {
    let (library, scene) = (library(), scene(falling()));
    let effect = library.by_id("custom.dropout").unwrap();
    let size = Parameters::from([("slope".to_owned(), -2e-3), ("dropout_v".to_owned(), 3.6)]);
    let mut work = library.gyro_effect("custom.dropout", &size, &scene, 1).unwrap();
    let Some(Explanation::Signal(signal)) = effect.explanation(&scene) else { panic!("a signal") };
    let shape = signal.shape(&scene, &size).unwrap();
    let coefficients = signal.coefficients(&scene, &shape, &size).unwrap();
    let columns = signal.columns(&scene, &shape);
    assert_eq!((shape.as_slice(), coefficients.as_slice(), columns.len()), (&[3.6][..], &[-2e-3][..], 1));
    for row in 0..scene.len() {
        // by hand
        let supply_v = 4.2 - 0.006 * row as f64;
        let wanted = if supply_v < 3.6 { -2e-3 * (3.6 - supply_v) } else { 0.0 };
        assert!((work.bias_rad_s(row, &scene) - wanted).abs() < 1e-15);
        assert!((coefficients[0] * columns[0].values[row] - wanted).abs() < 1e-15);
    }
    assert_eq!(signal.parameters(&scene, &shape, &coefficients), size);
    assert_eq!(signal.bounds().unwrap(), [[-1.0, 1.0]]);
    // what a fit puts out of bounds is at the bound
    assert_eq!(signal.parameters(&scene, &shape, &[7.0])["slope"], 1.0);
    let shapes = signal.shapes(&scene);
    assert!(shapes.len() == 16 && shapes[0] == [3.2] && (shapes[15][0] - 3.8).abs() < 1e-12);
}

#[test]
fn it_is_described_as_the_librarys_are_and_only_where_it_is_defined() {
    let about = library().by_id("custom.dropout").unwrap().about();
    assert_eq!((about.title, about.condition), ("regulator drops out", Some("supply_v")));
    assert_eq!(about.equation, "b = slope*max(0, dropout_v - supply_v)");
    assert!(std::ptr::eq(about, library().by_id("custom.dropout").unwrap().about()), "allocated once");
    assert!(Library::new().by_id("custom.dropout").is_none());
    assert_eq!(super::about("custom.dropout").unwrap().title, "regulator drops out");
    assert_eq!(unit("custom.dropout", "slope"), Some("rad/s per V"));
    let config = Config::parse(&format!("{REST}{DROPOUT}"), "sim.toml").unwrap();
    assert!(Library::without(["custom.dropout"]).with_own(&config).unwrap().by_id("custom.dropout").is_none());
}

#[test]
fn without_what_it_follows_it_explains_nothing_and_says_what_is_missing() {
    let library = library();
    let effect = library.by_id("custom.dropout").unwrap();
    for supply in [None, Some(vec![5.0; 200])] {
        assert!(effect.explanation(&scene(supply)).is_none());
    }
    let made = |pairs: &[(&str, f64)], scene: &Scene| {
        let parameters = pairs.iter().map(|(name, v)| ((*name).to_owned(), *v)).collect();
        library.gyro_effect("custom.dropout", &parameters, scene, 1).err().map(|e| e.to_string())
    };
    let whole = [("slope", 1e-3), ("dropout_v", 3.6)];
    assert_eq!(made(&whole, &scene(falling())), None);
    assert!(made(&whole, &scene(None)).unwrap().contains("needs supply_v"));
    assert!(made(&whole[..1], &scene(falling())).unwrap().contains("dropout_v"));
    assert!(made(&[("slope", 3.0), ("dropout_v", 3.6)], &scene(falling())).unwrap().contains("not physical"));
}
