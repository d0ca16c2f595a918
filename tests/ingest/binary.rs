//! `gyroid inspect` as a user runs it.

use super::*;
use assert_cmd::Command;

fn gyroid(arguments: &[&str]) -> (i32, String, String) {
    let output = Command::cargo_bin("gyroid").unwrap().args(arguments).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn the_table_shows_rates_gaps_units_rest_and_motion() {
    let files = Files::new();
    let path = files.put("rest.csv", csv("gz_rad_s", 1.0, 4000));
    let (code, out, err) = gyroid(&["inspect", path.to_str().unwrap()]);
    assert_eq!((code, err.as_str()), (0, ""));
    for part in [
        "4000 rows",
        "gyro z",
        "in rad/s",
        "100 Hz, even",
        "gaps      none",
        "median",
        "motion  none found",
        "can use z",
    ] {
        assert!(out.contains(part), "{part:?} is not in\n{out}");
    }
}

#[test]
fn json_goes_to_a_file_or_to_standard_output() {
    let files = Files::new();
    let path = files.put("rest.csv", csv("gz_rad_s", 1.0, 4000));
    let path = path.to_str().unwrap();
    let (code, out, _) = gyroid(&["inspect", path, "--json", "-"]);
    let json: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(code, 0);
    assert_eq!(json["rows"], 4000);
    assert_eq!(json["fits"], true);
    assert_eq!(json["columns"][1]["role"], "gyro z");
    assert_eq!(json["time"]["clock"]["counts_from"], "power_on");
    assert_eq!(json["gyro"][0]["audit"]["gaps"]["handling"], "kept");
    let target = files.path("report.json");
    let (code, out, _) = gyroid(&["inspect", path, "--quiet", "--json", target.to_str().unwrap()]);
    assert_eq!((code, out.as_str()), (0, ""));
    assert_eq!(serde_json::from_str::<serde_json::Value>(&std::fs::read_to_string(target).unwrap()).unwrap(), json);
}

#[test]
fn bad_input_ends_with_one_and_names_the_mend() {
    let files = Files::new();
    let (code, out, err) = gyroid(&["inspect", files.path("absent.csv").to_str().unwrap()]);
    assert_eq!((code, out.as_str()), (1, ""));
    assert!(err.contains("absent.csv") && err.contains("hint: check the path"), "{err}");
    let path = files.put("rest.csv", csv("gz_rad_s", 1.0, 100));
    let (code, out, _) = gyroid(&["inspect", path.to_str().unwrap(), "--json", "/no/such/dir/x.json"]);
    assert_eq!((code, out.as_str()), (1, ""));
    let (code, _, _) = gyroid(&["inspect"]);
    assert_eq!(code, 2);
}

#[test]
fn a_file_that_no_fit_can_use_is_shown_all_the_same() {
    let files = Files::new();
    let path = files.put("pose.csv", "t_s,x_m\n0,1\n0.1,2\n0.2,oops\n0.3,4\n");
    let (code, out, _) = gyroid(&["inspect", path.to_str().unwrap()]);
    assert_eq!(code, 0);
    for part in ["x_m", "not a number: \"oops\" at row 3", "no column of the gyro's z axis", "cannot use this file"] {
        assert!(out.contains(part), "{part:?} is not in\n{out}");
    }
}
