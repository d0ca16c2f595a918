//! What `gyroid export` writes, prints and refuses.

use super::*;

fn json_of(arguments: &[&str]) -> (i32, Value) {
    let (code, out, err) = run(gyroid().arg("export").args(arguments).args(["--json", "-"]));
    (code, serde_json::from_str(&out).unwrap_or_else(|e| panic!("{e}: {out} {err}")))
}

#[test]
fn the_command_writes_what_it_says() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("imu.yaml");
    let config = fixture("full.toml");
    let config = config.to_str().unwrap();
    let (code, text, err) =
        run(gyroid().args(["export", config, "--to", "kalibr", "--topic", "/imu0", "-o"]).arg(&out));
    assert_eq!(code, 0, "{err}");
    assert!(text.contains("gyroscope_noise_density = 1.7e-04") && text.contains("left out"), "{text}");
    let written = fs::read_to_string(&out).unwrap();
    assert!(written.contains("\nrostopic: \"/imu0\"\n"), "{written}");
    // to standard output the file is all that is said
    let (code, text, _) = run(gyroid().args(["export", config, "--to", "KALIBR", "--topic", "/imu0"]));
    assert_eq!(code, 0);
    let without_command = |t: &str| t.lines().filter(|l| !l.contains("command:")).map(String::from).collect::<Vec<_>>();
    assert!(without_command(&text).ends_with(&without_command(&written)[3..]), "{text}");
    let (code, json) = json_of(&[config, "--to", "kalibr"]);
    assert_eq!(
        (code, &json["written"], &json["configuration"]["signed"]),
        (0, &Value::Bool(true), &Value::Bool(false))
    );
    assert_eq!(json["keys"][0]["key"], "gyroscope_noise_density");
    assert_eq!(json["keys"][0]["value"].as_f64(), Some(N));
    assert_eq!(json["keys"][0]["ci95"][0].as_f64(), Some(1.68e-4));
    assert_eq!(json["keys"][0]["unit"], "rad/s/sqrt(Hz), continuous");
    assert!(json["left_out"][0]["hint"].is_string() && json["text"].as_str().unwrap().contains("update_rate: 200.0"));
}

#[test]
fn the_list_explains_every_target() {
    let (code, text, _) = run(gyroid().args(["export", "--list"]));
    assert_eq!(code, 0);
    let (_, json) = json_of(&["--list"]);
    let targets = json["targets"].as_array().unwrap();
    assert_eq!(targets.len(), export::registry().len());
    for target in targets {
        for key in ["id", "program", "file", "needs", "convention", "source"] {
            let word = target[key].as_str().unwrap();
            assert!(!word.is_empty() && text.contains(word), "{key}: {word}");
        }
        assert!(!target["keys"].as_array().unwrap().is_empty());
    }
    let (_, json) = json_of(&["--list", "--to", "px4"]);
    assert_eq!(json["targets"].as_array().unwrap().len(), 1);
}

#[test]
fn bad_input_is_named_and_has_its_exit_code() {
    let dir = tempfile::tempdir().unwrap();
    let refused = |text: String, code: i32, parts: &[&str]| {
        let path = dir.path().join("c.toml");
        fs::write(&path, text).unwrap();
        let (found, out, err) = run(gyroid().arg("export").arg(&path).args(["--to", "kalibr"]));
        assert_eq!(found, code, "{out}{err}");
        for part in parts.iter().chain(&["c.toml"]) {
            assert!(format!("{out}{err}").contains(part) || code == 3, "{part}: {out}{err}");
        }
    };
    let bare = fs::read_to_string(fixture("bare.toml")).unwrap();
    let full = fs::read_to_string(fixture("full.toml")).unwrap();
    refused(bare.replace("schema = 1", "schema = 7"), 1, &["schema 7", "hint:"]);
    refused(bare.replace("schema = 1\n", ""), 1, &["schema", "hint:"]);
    refused("schema = 1\n".into(), 1, &["[gyro] is missing", "hint:"]);
    refused(bare.replace("1.7e-4", "0.0"), 1, &["angle_random_walk_rad_sqrt_s", "hint:"]);
    refused(bare.replace("1.7e-4", "-1.7e-4"), 1, &["not physical"]);
    refused(full.replace("estimate = 2.0e-5", "estimate = 2.1e-5"), 1, &["rate_random_walk_rad_s_sqrt_s", "the same"]);
    refused(full.replace("ci95 = [1.68e-4, 1.72e-4]", "ci95 = [1.72e-4, 1.68e-4]"), 1, &["outside its interval"]);
    refused(full.replace("rate_random_walk_rad_s_sqrt_s]", "random_walk]"), 1, &["random_walk"]);
    refused(full.replace("correlation_time_s = 1800.0", "correlation_time_s = 0.0"), 1, &["correlation_time_s"]);
    refused(full.replace("white = true", "white = false"), 3, &["not white"]);

    let config = fixture("full.toml");
    let config = config.to_str().unwrap();
    assert_eq!(run(gyroid().args(["export", config])).0, 2);
    assert_eq!(run(gyroid().args(["export", config, "--to", "kalib"])).0, 2);
    assert_eq!(run(gyroid().args(["export", config, "--to", "kalibr", "--rate", "0"])).0, 2);
    assert_eq!(run(gyroid().args(["export", config, "--to", "kalibr", "--topic", "a b"])).0, 2);
    assert_eq!(run(gyroid().args(["export", config, "--to", "kalibr", "--axis", "w"])).0, 2);
    for (option, value) in
        [("--rate", "nan"), ("--step", "inf"), ("--device-id", "4000000000"), ("--power-on-temperature", "-300")]
    {
        let (code, _, err) = run(gyroid().args(["export", config, "--to", "px4", option, value]));
        assert!(code == 2 && err.contains(option), "{err}");
    }
    let (code, _, err) = run(gyroid().args(["export", config, "--to", "kalibr", "-o", config]));
    assert!(code == 2 && err.contains("full.toml") && full == fs::read_to_string(config).unwrap(), "{err}");
    let (code, _, err) = run(gyroid().args(["export", "none.toml", "--to", "kalibr", "-o", "/no/such/folder/x.yaml"]));
    assert!(code == 1 && err.contains("/no/such/folder"), "the output is claimed first: {err}");
}

#[test]
fn an_unfit_model_leaves_nothing_behind() {
    let dir = tempfile::tempdir().unwrap();
    let (config, out) = (dir.path().join("c.toml"), dir.path().join("imu.yaml"));
    let full = fs::read_to_string(fixture("full.toml")).unwrap();
    fs::write(&config, full.replace("white = true", "white = false")).unwrap();
    let mut command = gyroid();
    command.arg("export").arg(&config).args(["--to", "kalibr", "--json", "-", "-o"]).arg(&out);
    let (code, text, _) = run(&mut command);
    let json: Value = serde_json::from_str(&text).unwrap();
    assert_eq!((code, &json["written"]), (3, &Value::Bool(false)));
    assert!(json["why"].as_str().unwrap().contains("not white") && !out.exists());
    assert_eq!(run(command.arg("--accept")).0, 0);
    assert!(fs::read_to_string(&out).unwrap().contains("NOT FIT FOR USE"));
}

#[test]
fn what_the_fit_wrote_only_because_it_was_told_to_is_held_back() {
    let dir = tempfile::tempdir().unwrap();
    let (log, config) = (dir.path().join("short.csv"), dir.path().join("gyroid.toml"));
    // 80 s of a warm-up of 200 s: T is not identifiable
    fs::write(&log, warm_up_csv(4, 160)).unwrap();
    let mut fit = gyroid();
    fit.arg("fit").arg(&log).args(["--accept", "--no-plot", "-o"]).arg(&config);
    assert_eq!(run(&mut fit).0, 0);
    let (code, text, _) = run(gyroid().arg("export").arg(&config).args(["--to", "gazebo"]));
    assert_eq!(code, 3, "{text}");
    assert!(text.contains("not fit for use") && !text.contains("<sdf"), "{text}");
    let (code, text, _) = run(gyroid().arg("export").arg(&config).args(["--to", "gazebo", "--accept"]));
    assert!(code == 0 && text.contains("NOT FIT FOR USE") && text.contains("<sdf"), "{text}");
}

#[test]
fn what_the_fit_has_just_written_is_exported() {
    let dir = tempfile::tempdir().unwrap();
    let config = dir.path().join("gyroid.toml");
    let mut fit = gyroid();
    fit.arg("fit")
        .arg(data("power_on.csv"))
        .arg("--base")
        .arg(data("robot.toml"))
        .args(["--no-plot", "-o"])
        .arg(&config);
    assert_eq!(run(&mut fit).0, 0);
    let read = Config::read(&config).unwrap();
    let (code, json) = json_of(&[config.to_str().unwrap(), "--to", "gnss-ins-sim"]);
    assert_eq!((code, &json["axis"], &json["axis_assumed"]), (0, &Value::from("z"), &Value::Bool(false)));
    assert_eq!(json["configuration"]["signed"], true);
    let gyro = read.require_gyro().unwrap();
    let text = json["text"].as_str().unwrap();
    let provenance = read.provenance.as_ref().unwrap();
    assert!(text.contains("power_on.csv") && text.contains(&provenance.log_sha256) && !text.contains("unsigned"));
    let bias = json["keys"][0]["value"][2].as_f64().unwrap();
    close(bias, (gyro.c1_rad_s + gyro.c2_rad_s) * 180.0 / PI * 3600.0);
    // the interval of a sum of correlated estimates
    let c = gyro.covariance.unwrap();
    let std = (c.c1_c1_rad2_s2 + 2.0 * c.c1_c2_rad2_s2 + c.c2_c2_rad2_s2).sqrt() * 180.0 / PI * 3600.0;
    let [low, high] = [0, 1].map(|i| json["keys"][0]["ci95"][i].as_f64().unwrap());
    assert!(((high - low) / (2.0 * 1.959_964 * std) - 1.0).abs() < 1e-6);
}

#[test]
fn the_axis_is_that_of_the_column() {
    let mut config = full();
    let mut provenance = Provenance { column: "angular_velocity.x".into(), ..Provenance::default() };
    config.provenance = Some(provenance.clone());
    let export = of(&config, "kf-gins");
    assert_eq!((export.axis, export.axis_assumed), (Axis::X, false));
    assert!(many(&export, "initgyrbias")[0] > 0.0);
    provenance.column = "rate".into();
    config.provenance = Some(provenance);
    let export = of(&config, "kf-gins");
    assert_eq!((export.axis, export.axis_assumed), (Axis::Z, true));
    assert!(export.notes.iter().any(|n| n.contains("assumed")));
}
