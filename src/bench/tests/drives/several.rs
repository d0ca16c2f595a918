//! Several drives of one robot fitted together: their evidence adds up, what is drawn anew in each is its own, and nothing goes
//! on from one to the next.

use crate::config::{Config, EffectTable};
use crate::effects::Library;
use crate::effects::drive::registry;
use crate::gap::drive::ekf::innovations::{Summed, run_scoped};
use crate::gap::drive::ekf::noise::Noise;
use crate::gap::drive::fit::models;
use crate::gap::drive::model_selection::{Judged, judge, mounting};
use crate::gap::drive::options::Options as JudgeOptions;
use crate::gap::drive::preprocess::wheel_offset::put_back;
use crate::gap::drive::record::Record;
use crate::gap::drive::regressors::basis::{Column, Scoped};
use crate::gap::drive::regressors::candidates::Candidates;
use crate::gap::selection::sets::Main;
use crate::gap::{Answer, Drive};
use crate::signal::{Log, TimeAxis, names};
use crate::simulate::{Course, Options, drive_with};
use assert_cmd::Command;
use std::path::Path;

const ROBOT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.02\n\
    [gyro]\nc1_rad_s = -2.4e-3\nc2_rad_s = 8e-3\ntime_constant_s = 240.0\nangle_random_walk_rad_sqrt_s = 1.5e-4\n\
    turn_on_bias_std_rad_s = 2e-4\nwarm_up_relative_std = 0.01\n\
    [vehicle]\nmass_kg = 9.5\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\nwheel_radius_m = 0.05\n\
    wheel_inertia_kg_m2 = 0.0008\nviscous_friction_n_m_s = 0.0006\ntorque_noise_n_m_sqrt_s = 0.002\n\
    [encoder]\nspeed_noise_std_rad_s = 0.02\n\
    [pose]\nrate_hz = 5.0\nposition_std_m = 0.002\nheading_std_rad = 0.002\n";

fn robot() -> Config {
    Config::parse(ROBOT, "robot.toml").unwrap()
}

/// A minute of the robot with one effect, its gyro's C2 this far from nominal.
fn recorded(effect: Option<(&str, &str, f64)>, turn_on_rad_s: f64, seed: u64) -> Log {
    let mut config = robot();
    let effects =
        effect.map(|(id, name, value)| EffectTable { id: id.into(), parameters: [(name.into(), value)].into() });
    config.effects.extend(effects);
    config.gyro.as_mut().unwrap().c2_rad_s += turn_on_rad_s;
    let mut log = drive_with(&config, Course::Brisk, 60.0, &Options::from(seed), &Library::new()).unwrap().log;
    log.source = format!("drive{seed}");
    log
}

fn together(logs: &[&Log]) -> Record {
    let drives: Vec<Drive> = logs.iter().map(|log| Drive::new(log, 0.0)).collect();
    Record::of_drives(&robot(), &drives).unwrap()
}

fn judged(record: &Record) -> Judged {
    judge(record, registry(), &JudgeOptions::default())
}

fn main_of(judged: &Judged) -> Main {
    judged.findings.top()
}

fn without(mut log: Log, lost: &[&str]) -> Log {
    log.channels.retain(|c| !lost.contains(&c.name.as_str()));
    log
}

fn summed(record: &Record, columns: &[Scoped], all: &Candidates) -> Summed {
    let models = models(record, &all.change_list(), &all.zero(), true);
    run_scoped(record, &models, &Noise::believed(record, None), columns, |_| {})
}

#[test]
fn sums_of_two_drives_are_those_of_each_added() {
    let first = recorded(None, 1e-4, 1);
    // another clock, another course, another time since power-on
    let mut second = recorded(Some(("gyro.scale_factor", "relative", 0.01)), -1e-4, 2);
    second.time = second.time.shifted(1234.5);
    let joined = together(&[&first, &second]);
    assert_eq!((joined.starts.clone(), joined.len()), (vec![0, first.len()], first.len() + second.len()));
    let all = Candidates::new(&joined, registry(), &JudgeOptions::default().prior, true, &[]);
    // what follows speed, yaw rate or torque is scaled by what is usual in all drives together
    let scaled = |c: &Scoped| matches!(c.column, Column::Free(..) | Column::Varying(..)) && c.drive.is_none();
    let columns: Vec<Scoped> = all.columns.iter().copied().filter(|c| !scaled(c)).collect();
    let both = summed(&joined, &columns, &all);
    let last = columns.len();
    let alone = [&first, &second].map(|log| together(&[log]));
    let mut ln_likelihood = 0.0;
    let mut gram = vec![vec![0.0; last + 1]; last + 1];
    for (drive, record) in alone.iter().enumerate() {
        let places: Vec<usize> = (0..last).filter(|c| columns[*c].acts_in(drive)).collect();
        assert!(places.len() < last && places.len() > 100, "{} of {last}", places.len());
        let own: Vec<Scoped> = places.iter().map(|c| Scoped::from(columns[*c].column)).collect();
        let sums = summed(record, &own, &all);
        ln_likelihood += sums.ln_likelihood();
        let places: Vec<usize> = places.into_iter().chain([last]).collect();
        for (i, to) in places.iter().enumerate() {
            for (j, from) in places.iter().enumerate() {
                gram[*to][*from] += sums.gram[(i, j)];
            }
        }
    }
    assert!((both.ln_likelihood() - ln_likelihood).abs() < 1e-9 * ln_likelihood.abs(), "{ln_likelihood}");
    for i in 0..=last {
        for j in 0..=last {
            // slopes are differences over a ten-thousandth of a scale: rounding leaves 1e-12, which whole drives add up
            let scale = (gram[i][i] * gram[j][j]).sqrt().max(1e-12);
            let [sum, added] = [both.gram[(i, j)], gram[i][j]];
            let of = || [i, j].map(|c| columns.get(c));
            assert!((sum - added).abs() < 1e-8 * scale, "{sum} {added} {scale}: {:?}", of());
        }
    }
}

#[test]
fn two_halves_of_a_proof_are_one() {
    const SIZE: f64 = 1.9e-4;
    let effect = Some(("gyro.scale_factor", "relative", SIZE));
    let logs = [1, 2].map(|seed| recorded(effect, 0.0, seed));
    let said = |record: &Record| {
        let found = judged(record);
        let set = found.findings.best_with("gyro.scale_factor", false).unwrap();
        let part = set.part("gyro.scale_factor").unwrap();
        (main_of(&found), part.parameters["relative"], part.std["relative"])
    };
    // two to three standard deviations in each: what chance does in one of twenty effects, each as probable as one in twenty
    let alone = [0, 1].map(|i| said(&together(&[&logs[i]])));
    assert!(alone.iter().all(|a| a.0 != Main::Effect("gyro.scale_factor".into())), "{alone:?}");
    let both = said(&together(&[&logs[0], &logs[1]]));
    assert_eq!(both.0, Main::Effect("gyro.scale_factor".into()), "{both:?}");
    assert!((both.1 - SIZE).abs() < 4.0 * both.2, "{both:?}");
    // information adds up, that of the prior aside
    let information = alone.iter().map(|a| a.2.powi(-2)).sum::<f64>();
    assert!((both.2 * information.sqrt() - 1.0).abs() < 0.03, "{both:?} {alone:?}");
}

#[test]
fn turn_on_biases_of_their_own_are_no_gap() {
    // four stated standard deviations apart, some thirty of what a drive knows its own bias to
    let logs = [recorded(None, 4e-4, 1), recorded(None, -4e-4, 2), recorded(None, 0.0, 3)];
    let found = judged(&together(&[&logs[0], &logs[1], &logs[2]]));
    assert_eq!(main_of(&found), Main::None, "{:?}", found.findings.mains());
}

#[test]
#[ignore = "battery: some seconds"]
fn battery_a_bias_that_jumps_in_each_drive_at_a_time_of_its_own_is_one_effect() {
    let step = |at_s: f64, seed: u64| {
        let mut log = recorded(None, 0.0, seed);
        let from = (at_s / 0.02) as usize;
        let gyro = log.channels.iter_mut().find(|c| c.name == names::GYRO_Z).unwrap();
        gyro.values[from..].iter_mut().for_each(|v| *v += 2e-3);
        log
    };
    let found = judged(&together(&[&step(20.0, 1), &step(45.0, 2)]));
    assert_eq!(main_of(&found), Main::Effect("gyro.bias_step".into()), "{:?}", found.findings.mains());
    let part = found.findings.best_with("gyro.bias_step", true).unwrap().part("gyro.bias_step").unwrap().clone();
    let (size, std) = (part.parameters["step_rad_s"], part.std["step_rad_s"]);
    assert!((size - 2e-3).abs() < 5.0 * std, "{size} ± {std}");
    let [at_s, _] = part.time_s.unwrap();
    let truth_s = if part.description.contains("drive1") { 20.0 } else { 45.0 };
    assert!((at_s - truth_s).abs() < 0.5, "{part:?}");
}

#[test]
#[ignore = "battery: some ten seconds and more"]
fn battery_a_constant_that_differs_from_drive_to_drive_is_none() {
    let drives = |mass: [f64; 2]| {
        let logs = [0, 1].map(|i| recorded(Some(("vehicle.payload", "mass_relative", mass[i])), 0.0, 1 + i as u64));
        main_of(&judged(&together(&[&logs[0], &logs[1]])))
    };
    assert_eq!(drives([0.1, 0.1]), Main::Effect("vehicle.payload".into()));
    assert_eq!(drives([0.2, 0.0]), Main::Unknown);
}

#[test]
fn drives_that_do_not_go_together_are_refused_by_name() {
    let (good, bad) = (recorded(None, 0.0, 1), recorded(None, 0.0, 2));
    let refused = |first: &Log, second: &Log| {
        let drives = [first, second].map(|log| Drive::new(log, 0.0));
        Record::of_drives(&robot(), &drives).unwrap_err().to_string()
    };
    for (lost, what) in [
        (&[names::TORQUE_LEFT, names::TORQUE_RIGHT][..], "no torques"),
        (&[names::GYRO_Z], "no gyro"),
        (&[names::X, names::Y, names::HEADING], "no pose"),
    ] {
        let message = refused(&good, &without(bad.clone(), lost));
        assert!(message.contains("drive2") && message.contains(what), "{message}");
    }
    let mut slow = bad.clone();
    slow.time = TimeAxis::Uniform { start_s: 0.0, step_s: 0.03, len: bad.len() };
    let message = refused(&good, &slow);
    assert!(message.contains("drive2") && message.contains("0.03"), "{message}");
    let mut few = bad;
    few.time = TimeAxis::Uniform { start_s: 0.0, step_s: 0.02, len: 3 };
    few.channels.iter_mut().for_each(|c| c.values.truncate(3));
    assert!(refused(&good, &few).contains("drive2"));
}

#[test]
fn lost_ticks_of_each_drive_are_found_in_it() {
    let lossy = Some(("encoder.missed_ticks", "loss_fraction", 0.06));
    let logs = [1, 2].map(|seed| recorded(lossy, 0.0, seed));
    let found = judged(&together(&[&logs[0], &logs[1]]));
    assert_eq!(main_of(&found), Main::Effect("encoder.missed_ticks".into()), "{:?}", found.findings.mains());
    let set = found.findings.best_with("encoder.missed_ticks", true).unwrap();
    let part = set.part("encoder.missed_ticks").unwrap();
    let (loss, std) = (part.parameters["loss_fraction"], part.std["loss_fraction"]);
    assert!((loss - 0.06).abs() < 5.0 * std, "{loss} ± {std}");
}

/// All numbers of a record, missing ones included.
fn numbers(record: &Record) -> Vec<u64> {
    let pose = record.pose.iter().flatten().flatten();
    let wheels = record.wheels_rad_s.iter().flatten();
    let gyro = record.gyro_rad_s.iter().flatten();
    record
        .times_s
        .iter()
        .chain(&record.since_power_on_s)
        .chain(wheels)
        .chain(gyro)
        .chain(pose)
        .map(|v| v.to_bits())
        .collect()
}

#[test]
fn what_is_put_back_or_taken_out_of_drives_is_that_of_each() {
    let open = ROBOT.to_string() + "lever_arm_std_m = 0.1\nheading_offset_std_rad = 0.05\ndelay_std_s = 0.05\n";
    let open = Config::parse(&open, "robot.toml").unwrap();
    let logs = [1, 2].map(|seed| without(recorded(None, 0.0, seed), &[names::TORQUE_LEFT, names::TORQUE_RIGHT]));
    let drives = [0, 1].map(|i| Drive::new(&logs[i], 5.0 * i as f64));
    let both = Record::of_drives(&open, &drives).unwrap();
    let mounting = mounting(&both, registry(), &JudgeOptions::default()).unwrap();
    let changes: [&dyn Fn(&Record) -> Record; 2] = [&|r| put_back(r, 0.25), &|r| mounting.taken_out(r)];
    for change in changes {
        let changed = change(&both);
        assert_ne!(numbers(&changed), numbers(&both));
        let rows = changed.starts.iter().copied().zip(changed.starts.iter().skip(1).copied().chain([changed.len()]));
        for ((from, to), drive) in rows.zip(&drives) {
            let alone = change(&Record::of_drives(&open, &[*drive]).unwrap());
            let part = |v: &Vec<f64>| v[from..to].to_vec();
            let own = Record {
                times_s: part(&changed.times_s),
                since_power_on_s: part(&changed.since_power_on_s),
                wheels_rad_s: changed.wheels_rad_s.each_ref().map(part),
                gyro_rad_s: changed.gyro_rad_s.as_ref().map(part),
                pose: changed.pose.as_ref().map(|p| p.each_ref().map(part)),
                ..alone.clone()
            };
            assert_eq!(numbers(&own), numbers(&alone));
        }
    }
}

/// Exit code, standard output, standard error of `gyroid`.
fn run(dir: &Path, line: &str) -> (i32, String, String) {
    let output = Command::cargo_bin("gyroid").unwrap().current_dir(dir).args(line.split(' ')).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

#[test]
#[ignore = "battery: drives of the generator"]
fn battery_each_fit_begins_a_drive() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    std::fs::write(dir.join("sim.toml"), ROBOT).unwrap();
    std::fs::write(dir.join("real.toml"), format!("{ROBOT}[[effect]]\nid = \"gyro.scale_factor\"\nrelative = 0.01\n"))
        .unwrap();
    let rest = ROBOT.split("[vehicle]").next().unwrap().replace("driving", "stationary");
    std::fs::write(dir.join("rest.toml"), rest).unwrap();
    for seed in 1..=4 {
        let line = format!("simulate real.toml --course brisk --duration 40 --seed {seed} -o {seed}.csv");
        assert_eq!(run(dir, &line).0, 0, "{line}");
        // the same drive in two files
        let text = std::fs::read_to_string(dir.join(format!("{seed}.csv"))).unwrap();
        let rows: Vec<Vec<&str>> = text.lines().map(|l| l.split(',').collect()).collect();
        let write = |name: &str, keep: &dyn Fn(&str) -> bool| {
            let columns: Vec<usize> =
                (0..rows[0].len()).filter(|c| rows[0][*c] == "t_s" || keep(rows[0][*c])).collect();
            let line = |row: &Vec<&str>| columns.iter().map(|c| row[*c]).collect::<Vec<_>>().join(",") + "\n";
            std::fs::write(dir.join(name), rows.iter().map(line).collect::<String>()).unwrap();
        };
        write(&format!("wheels{seed}.csv"), &|c| c.starts_with("wheel"));
        write(&format!("rest{seed}.csv"), &|c| !c.starts_with("wheel"));
    }
    let line = "gap diagnose sim.toml --fit 1.csv --fit 2.csv --hold 3.csv --hold 4.csv --json a.json --write-sim augmented.toml";
    let (code, text, error) = run(dir, line);
    assert_eq!(code, 0, "{error}");
    assert!(text.contains("recording: 1.csv; 2.csv, hold-out: 3.csv; 4.csv"), "{text}");
    assert!(text.contains("2 drives are fitted together: 1.csv; 2.csv"), "{text}");
    let read =
        |name: &str| -> Answer { serde_json::from_str(&std::fs::read_to_string(dir.join(name)).unwrap()).unwrap() };
    let whole = read("a.json");
    assert_eq!(whole.main.as_deref(), Some("gyro.scale_factor"));
    assert!(whole.navigation.is_some());
    assert_eq!(Config::read(dir.join("augmented.toml")).unwrap().effects.len(), 1);

    // sensors of a drive in files of their own
    let line = "gap diagnose sim.toml --fit wheels1.csv rest1.csv --fit wheels2.csv rest2.csv --json b.json -q";
    let (code, _, error) = run(dir, line);
    assert_eq!(code, 0, "{error}");
    let parts = read("b.json");
    let relative = |answer: &Answer| answer.effects[0].parameters["relative"];
    assert_eq!(parts.main, whole.main);
    assert!((relative(&parts) - relative(&whole)).abs() < 1e-9, "{} {}", relative(&parts), relative(&whole));

    for (line, code, found) in [
        ("sim.toml --fit 1.csv --fit wheels2.csv", 1, &["wheels2.csv", "no torques"][..]),
        ("sim.toml --fit 1.csv --fit none.csv", 1, &["none.csv"]),
        ("sim.toml --fit 1.csv 2.csv", 2, &["2.csv", "--fit 1.csv --fit 2.csv"]),
        ("sim.toml --fit 1.csv --fit 2.csv --hold 3.csv --start-offset 1,2", 2, &["--start-offset", "3 drives"]),
        ("rest.toml --fit 1.csv --fit 2.csv", 2, &["--fit", "at rest", "once"]),
        ("rest.toml --fit 1.csv --hold 2.csv 3.csv", 2, &["--hold", "several files"]),
        ("rest.toml --fit 1.csv --start-offset 1,2", 2, &["--start-offset"]),
    ] {
        let (status, _, error) = run(dir, &format!("gap diagnose {line}"));
        assert_eq!(status, code, "{line}: {error}");
        assert!(found.iter().all(|part| error.contains(part)), "{line}: {error}");
    }
}
