use super::*;
use crate::error::Result;
use crate::math::random::Stream;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// A gyro warming up (T 100 s) at 2 Hz, as CSV; `shift` moves C2.
fn log(folder: &Path, name: &str, seed: u64, shift: f64) -> PathBuf {
    let mut draw = Stream::new(seed, 0);
    let mut text = String::from("t_s,gyro_z_rad_s\n");
    for i in 0..1600 {
        let t = 0.5 * f64::from(i);
        let rate = shift - 5e-3 - 2e-3 * (-t / 100.0).exp_m1() + 3e-4 * draw.normal();
        text += &format!("{t},{rate}\n");
    }
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path
}

fn settings() -> Settings {
    Settings::default()
}

fn warm_up() -> WarmUp {
    let mut warm_up = WarmUp::default();
    warm_up.whiteness.draws = 99;
    warm_up
}

/// Fits, and counts how often a log was read and fitted by what `each` saw.
fn fitted(logs: &[PathBuf], settings: &Settings, jobs: usize, known: &[Row]) -> (Done<Row>, usize) {
    let mut fresh = 0;
    let mut each = |_: &Row, origin: Origin| {
        fresh += usize::from(origin == Origin::Fitted);
        Ok(())
    };
    let done = analyse_all(logs, settings, &warm_up(), jobs, known, &mut each).unwrap();
    (done, fresh)
}

#[test]
fn folders_are_searched_for_logs_alone() {
    let dir = tempfile::tempdir().unwrap();
    let root = dir.path();
    std::fs::create_dir_all(root.join("b/.git")).unwrap();
    for name in ["z.CSV", "a.csv.gz", "b/x.ulg", "b/.git/y.csv", ".gyroid-1.csv", "notes.md", "results.csv", "b/p.png"]
    {
        std::fs::write(root.join(name), "x").unwrap();
    }
    let found = find(&[root.to_path_buf(), root.join("z.CSV"), root.join("notes.md")], &[root.join("results.csv")]);
    let found = found.unwrap();
    let names: Vec<_> = found.iter().map(|p| p.strip_prefix(root).unwrap().to_str().unwrap().to_string()).collect();
    // a file that is named itself is taken at its word, and none is taken twice
    assert_eq!(names, ["a.csv.gz", "b/x.ulg", "z.CSV", "notes.md"]);
    let error = find(&[root.join("b/.git")], &[root.join("b/.git/y.csv")]).unwrap_err();
    assert!(error.to_string().contains("holds no log") && error.hint.unwrap().contains("parquet"));
}

#[test]
fn a_bad_log_is_a_row_and_the_jobs_change_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let mut logs: Vec<PathBuf> = (0..3).map(|i| log(dir.path(), &format!("{i}.csv"), i, 0.0)).collect();
    let whole = std::fs::read(&logs[0]).unwrap();
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    std::io::Write::write_all(&mut packed, &whole).unwrap();
    let packed = packed.finish().unwrap();
    let cut = dir.path().join("cut.csv.gz");
    std::fs::write(&cut, &packed[..packed.len() / 2]).unwrap();
    logs.insert(1, cut);
    logs.push(dir.path().join("no_such.csv"));
    let (one, _) = fitted(&logs, &settings(), 1, &[]);
    let (two, fresh) = fitted(&logs, &settings(), 2, &[]);
    assert_eq!(one.rows, two.rows);
    assert_eq!((one.rows.len(), fresh, two.fitted, two.resumed), (5, 5, 5, 0));
    let error = one.rows[1].source.error.as_deref().unwrap();
    assert!(error.contains("cut.csv.gz") && error.contains("truncated"), "{error}");
    assert!(one.rows[1].c1_rad_s.is_none() && one.rows[1].source.sha256.len() == 64);
    assert!(
        one.rows[4].source.error.as_deref().unwrap().contains("no_such.csv") && one.rows[4].source.sha256.is_empty()
    );
    let good = &one.rows[0];
    assert!((good.time_constant_s.unwrap() - 100.0).abs() < 5.0 * good.time_constant_std_s.unwrap());
    assert_eq!(
        (good.samples, good.source.axis.as_str(), good.source.column.as_deref()),
        (Some(1600), "z", Some("gyro_z_rad_s"))
    );
    assert!(good.source.modified.as_deref().unwrap().ends_with('Z'), "{:?}", good.source.modified);
}

#[test]
fn what_is_known_is_not_fitted_anew() {
    let dir = tempfile::tempdir().unwrap();
    let logs: Vec<PathBuf> = (0..3).map(|i| log(dir.path(), &format!("{i}.csv"), 10 + i, 0.0)).collect();
    let (first, fresh) = fitted(&logs, &settings(), 2, &[]);
    assert_eq!((fresh, first.resumed), (3, 0));
    // an estimate that no fit would find shows that none was made
    let mut known = first.rows.clone();
    known[2].c1_rad_s = Some(123.0);
    let (again, fresh) = fitted(&logs, &settings(), 2, &known);
    assert_eq!((fresh, again.resumed), (0, 3));
    assert_eq!(again.rows, known);
    // bytes decide, not names: renamed it is known, changed it is not
    let moved = dir.path().join("moved.csv");
    std::fs::rename(&logs[0], &moved).unwrap();
    log(dir.path(), "1.csv", 99, 0.0);
    let named = [moved.clone(), logs[1].clone(), logs[2].clone()];
    let (again, fresh) = fitted(&named, &settings(), 1, &known);
    assert_eq!((fresh, again.resumed), (1, 2));
    assert_eq!(again.rows[0].source.path, moved.display().to_string());
    assert_ne!(again.rows[1].source.sha256, known[1].source.sha256);
    // other options, another version, an error: all anew
    let other = Settings { trim_motion: true, ..settings() };
    assert_eq!(fitted(&logs[2..], &other, 1, &known).1, 1);
    known[2].source.gyroid_version = "0.0.1".into();
    assert_eq!(fitted(&logs[2..], &settings(), 1, &known).1, 1);
    known[2].clone_from(&first.rows[2]);
    known[2].source.error = Some("disk".into());
    assert_eq!(fitted(&logs[2..], &settings(), 1, &known).1, 1);
}

#[test]
fn an_error_of_the_one_who_looks_ends_the_work() {
    let dir = tempfile::tempdir().unwrap();
    let logs: Vec<PathBuf> = (0..4).map(|i| log(dir.path(), &format!("{i}.csv"), i, 0.0)).collect();
    let mut seen = 0;
    let mut each = |_: &Row, _: Origin| -> Result<()> {
        seen += 1;
        Err(crate::Error::new(crate::ErrorKind::Io, "results.csv", "the disk is full"))
    };
    let error = analyse_all(&logs, &settings(), &warm_up(), 1, &[], &mut each).unwrap_err();
    assert_eq!((error.found.as_str(), seen), ("the disk is full", 1));
}

#[test]
fn results_come_back_whole_in_every_format() {
    let dir = tempfile::tempdir().unwrap();
    let path = log(dir.path(), "1.csv", 1, 0.0);
    let mut rows = fitted(&[path, dir.path().join("no.csv")], &settings(), 1, &[]).0.rows;
    rows[0].notes = Some("a \"quoted\", divided\nnote; °C".into());
    rows[0].time_constant_ci95_high_s = None;
    for name in ["r.parquet", "r.csv"] {
        let path = dir.path().join(name);
        results::write(&path, &rows).unwrap();
        assert_eq!(results::read::<Row>(&path).unwrap(), rows, "{name}");
        results::write::<Row>(&path, &[]).unwrap();
        assert!(results::read::<Row>(&path).unwrap().is_empty(), "{name}");
    }
    for (name, content) in [("r.parquet", "PAR1 and no more"), ("r.csv", "t_s,rate\n1,2\n")] {
        let path = dir.path().join(name);
        std::fs::write(&path, content).unwrap();
        let error = results::read::<Row>(&path).unwrap_err();
        assert!(error.to_string().contains(name) && error.hint.is_some(), "{error}");
    }
    assert_eq!(results::write(&dir.path().join("r.xlsx"), &rows).unwrap_err().kind, crate::ErrorKind::Usage);
}

/// A fitted row; C1 2e-3 rad/s, C2 -5e-3 rad/s, T 200 s, each off by its standard deviation times a draw of its own error, and by
/// the spread times another.
fn drawn(index: usize, spread: [f64; 3], draw: &mut Stream) -> Row {
    let scale = 1.0 + index as f64 % 4.0;
    let std = [1e-5 * scale, 2e-5 * scale, 2.0 * scale];
    // errors of C1 and T are correlated by 0.6, as in a fit
    let e: [f64; 3] = std::array::from_fn(|_| draw.normal());
    let error = [e[0], e[1], 0.6 * e[0] + 0.8 * e[2]];
    let d: [f64; 3] = std::array::from_fn(|_| draw.normal());
    let t = 200.0 * (spread[2] * d[2]).exp();
    Row {
        source: Source {
            path: format!("{index}.csv"),
            sha256: format!("{index:064}"),
            axis: "z".into(),
            ..Source::default()
        },
        warm_up_found: Some(true),
        identifiable: Some(true),
        white: Some(true),
        c1_rad_s: Some(2e-3 * (1.0 + spread[0] * d[0]) + std[0] * error[0]),
        c2_rad_s: Some(-5e-3 + spread[1] * d[1] + std[1] * error[1]),
        time_constant_s: Some(t + std[2] * error[2]),
        c1_std_rad_s: Some(std[0]),
        c2_std_rad_s: Some(std[1]),
        time_constant_std_s: Some(std[2]),
        c1_c2_covariance_rad2_s2: Some(0.0),
        c1_time_constant_covariance_rad: Some(0.6 * std[0] * std[2]),
        c2_time_constant_covariance_rad: Some(0.0),
        angle_random_walk_rad_sqrt_s: Some(1e-4),
        sample_rate_hz: Some(10.0),
        first_s: Some(0.0),
        span_s: Some(1800.0),
        whiteness_p_value: Some(0.4),
        whiteness_level: Some(0.05),
        ..Row::default()
    }
}

const TRUE_C2: f64 = 1e-4;
const TRUE_RELATIVE: f64 = 0.03;

fn simulated(logs: usize, seed: u64) -> Vec<Row> {
    let mut draw = Stream::new(seed, 5);
    (0..logs).map(|i| drawn(i, [TRUE_RELATIVE, TRUE_C2, TRUE_RELATIVE], &mut draw)).collect()
}

#[test]
fn intervals_of_the_repeatability_cover() {
    // seeds 0 to 1999; outlying logs are kept, because leaving out the farthest of an ordinary population narrows it
    let runs = 2000;
    let options = Options { keep_outlying: true, draws: 1, ..Options::default() };
    let covers = |seed: u64| {
        let rows = simulated(8, seed);
        let all = Population::by_axis(&rows, &options);
        let (c2, c1) = (all[0].c2.unwrap(), all[0].c1.unwrap());
        let warm_up = all[0].warm_up.unwrap();
        let inside = |[low, high]: [f64; 2], truth: f64| usize::from(low <= truth && truth <= high);
        [inside(c2.spread_ci95, TRUE_C2), inside(warm_up.ci95, TRUE_RELATIVE), inside(c1.relative_ci95, TRUE_RELATIVE)]
    };
    let sums = (0..runs).into_par_iter().map(covers).reduce(|| [0; 3], |a, b| std::array::from_fn(|i| a[i] + b[i]));
    // three binomial standard deviations; what is relative to an estimated mean may be off by its error, 0.03/√8 of 0.05
    let bound = 3.0 * (0.95 * 0.05 / runs as f64).sqrt() + 0.001;
    for (name, sum) in ["c2", "warm-up", "c1"].iter().zip(sums) {
        let share = sum as f64 / runs as f64;
        assert!((share - 0.95).abs() < bound, "{name}: {share}");
    }
}

#[test]
fn ordinary_populations_seldom_have_an_outlying_log_and_an_odd_unit_is_found() {
    // no more than 0.05 of them; seeds 0 to 399
    let runs = 400;
    let options = Options { draws: 199, ..Options::default() };
    let alarm = |seed: &u64| {
        let all = Population::by_axis(&simulated(10, 50_000 + seed), &options);
        assert!(all[0].outlying_tested);
        !all[0].outlying.is_empty()
    };
    let alarms = (0..runs).into_par_iter().filter(alarm).count() as f64 / runs as f64;
    assert!(alarms < 0.05 + 3.0 * (0.05 * 0.95 / runs as f64).sqrt(), "{alarms}");

    let mut rows = simulated(10, 7);
    rows[6].time_constant_s = Some(420.0);
    let all = Population::by_axis(&rows, &Options::default());
    let found: Vec<_> = all[0].outlying.iter().map(|o| (o.row, o.parameter)).collect();
    assert_eq!(found, [(6, "time_constant")], "{:?}", all[0].outlying);
    assert!(all[0].outlying[0].studentized > 5.0 && all[0].counted.len() == 9);
    let kept = Population::by_axis(&rows, &Options { keep_outlying: true, ..Options::default() });
    assert_eq!(kept[0].counted.len(), 10);
    assert!(kept[0].warm_up.unwrap().relative_std > 2.0 * all[0].warm_up.unwrap().relative_std);
}

#[test]
fn rows_that_do_not_count_say_why() {
    let mut rows = simulated(9, 3);
    rows[0].source.error = Some("truncated".into());
    rows[1].warm_up_found = Some(false);
    rows[2].identifiable = Some(false);
    rows[3].white = Some(false);
    rows[4].source.sha256 = rows[5].source.sha256.clone();
    rows[8].source.axis = "x".into();
    let all = Population::by_axis(&rows, &Options::default());
    assert_eq!(all.iter().map(|p| p.axis.as_str()).collect::<Vec<_>>(), ["z", "x"]);
    let z = &all[0];
    assert_eq!((z.logs, z.failed, &z.counted[..], z.outlying_tested), (8, 1, &[4, 6, 7][..], false));
    let why: Vec<(usize, &str)> = z.left_out.iter().map(|l| (l.row, l.why.as_str())).collect();
    assert_eq!(why[0], (1, "no warm-up found"));
    assert_eq!(why[1], (2, "T is not identifiable"));
    assert_eq!(why[2], (3, "the residuals are not white"));
    assert_eq!(why[3], (5, "the same bytes as 4.csv"));
    assert!(all[1].c2.is_none() && all[1].warm_up.is_none());
    let accepting = Options { accept_not_white: true, ..Options::default() };
    assert!(Population::by_axis(&rows, &accepting)[0].counted.contains(&3));
}

#[test]
fn a_parameter_that_was_given_has_no_spread() {
    let mut rows = simulated(6, 4);
    for row in &mut rows {
        (row.time_constant_s, row.time_constant_std_s) = (Some(200.0), Some(0.0));
        row.c1_time_constant_covariance_rad = Some(0.0);
    }
    let all = Population::by_axis(&rows, &Options::default());
    assert!(all[0].time_constant.is_none());
    let (c1, warm_up) = (all[0].c1.unwrap(), all[0].warm_up.unwrap());
    assert_eq!((warm_up.relative_std, warm_up.ci95), (c1.relative_spread, c1.relative_ci95));
    assert_eq!(all[0].means(&rows).unwrap()[2], 200.0);
    assert_eq!(all[0].mean_covariance[2], [0.0; 3]);
    assert!(all[0].mean_covariance[0][0] > 0.0);
}
