//! The data of the repository.

use crate::place::Place;
use std::path::Path;

#[test]
fn the_example_data_are_what_their_commands_make() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("data");
    let truth = gyroid::config::Config::read(data.join("truth.toml")).unwrap();
    let mut robot = gyroid::config::Config::read_base(data.join("robot.toml")).unwrap();
    assert!(robot.gyro.is_none());
    robot.gyro = truth.gyro.clone();
    assert_eq!(robot, truth);

    let p = Place::with(&[]);
    std::fs::copy(data.join("truth.toml"), p.path("truth.toml")).unwrap();
    p.ok("simulate truth.toml --duration 1800 --sample-time 0.1 --seed 1 -o again.csv");
    let [kept, again] = [data.join("power_on.csv"), p.path("again.csv")].map(|f| gyroid::ingest::read_log(&f).unwrap());
    assert_eq!(kept.len(), again.len());
    let gyro = |log: &gyroid::signal::Log| log.get("gyro_z_rad_s").unwrap().to_vec();
    for (a, b) in gyro(&kept).iter().zip(gyro(&again)) {
        // exp and ln of another platform may differ in the last digits
        assert!((a - b).abs() < 1e-14, "{a} {b}");
    }

    std::fs::copy(data.join("drives/rover_truth.toml"), p.path("rover_truth.toml")).unwrap();
    for (name, course) in [("rover_fit", "figure_eight --seed 11"), ("rover_hold", "square --seed 12")] {
        p.ok(&format!(
            "simulate rover_truth.toml --course {course} --duration 40 --start-offset 300 -o {name}.parquet"
        ));
        let file = format!("{name}.parquet");
        let [kept, again] =
            [data.join("drives").join(&file), p.path(&file)].map(|f| gyroid::ingest::read_log(&f).unwrap());
        assert_eq!(kept.len(), again.len());
        // the speed control hands such differences on
        let close = gyro(&kept).iter().zip(gyro(&again)).all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(close, "{name} is not what its command makes");
    }
}
