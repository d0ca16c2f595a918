//! `--html`: the page of each command, as a user has it written. `tests/pages/check.py` opens them in a browser.

use crate::place::Place;

const REST: &str = "schema = 1\nkind = \"stationary\"\nsample_time_s = 0.5\n[gyro]\nc1_rad_s = 2e-3\nc2_rad_s = -5e-3\n\
                    time_constant_s = 200.0\nangle_random_walk_rad_sqrt_s = 2e-4\nturn_on_bias_std_rad_s = 2e-4\n";
const TONE: &str = "[[effect]]\nid = \"gyro.tone\"\nfrequency_hz = 0.31\namplitude_rad_s = 3e-4\n";
const ROBOT: &str = include_str!("../common/robot.toml");
const PAYLOAD: &str = "[[effect]]\nid = \"vehicle.payload\"\nmass_relative = 0.4\ninertia_relative = 0.4\n";
/// Markup in the name of a file, which is read and shown everywhere.
const LOG: &str = "a<script>b.csv";

fn prepared() -> Place {
    let place = Place::with(&[
        ("rest.toml", REST),
        ("tone.toml", &format!("{REST}{TONE}")),
        ("robot.toml", ROBOT),
        ("heavy.toml", &format!("{ROBOT}{PAYLOAD}")),
    ]);
    place.ok(&format!("simulate rest.toml --duration 1500 --seed 1 -o {LOG}"));
    place
}

/// The page, which holds all `parts`, shows figures and loads nothing.
#[track_caller]
fn page(place: &Place, name: &str, parts: &[&str]) -> String {
    let page = place.read(name);
    for part in parts {
        assert!(page.contains(part), "{name} lacks {part}");
    }
    let figures = page.matches("<figure>").count();
    assert!(figures > 0 && page.matches("Good looks like this:").count() == figures, "{name}: {figures} figures");
    let markup: Vec<&str> = page.split('<').filter(|tag| !tag.starts_with("script>\n")).collect();
    assert!(!markup.iter().any(|tag| tag.contains("src=\"") || tag.contains("href=\"")), "{name} loads something");
    assert!(page.len() < 2_000_000 && page.contains("SHA-256"), "{name}: {} bytes", page.len());
    assert!(!page.contains("<script>b"), "{name} holds a name as markup");
    page
}

#[test]
fn commands_of_one_log_write_pages_with_verdict_figures_and_hashes() {
    let place = prepared();
    place.ok(&format!("fit {LOG} --no-plot -o fitted.toml --html fit.html"));
    page(
        &place,
        "fit.html",
        &["FIT FOR USE", "Log and fitted model", "What cannot be told", "a&lt;script&gt;b.csv", "gyroid fit"],
    );
    place.ok(&format!("fit {LOG} --no-plot --memory 0 --html stream.html"));
    page(&place, "stream.html", &["FIT FOR USE", "Residuals"]);
    place.ok(&format!("noise {LOG} --draws 99 --html noise.html"));
    page(&place, "noise.html", &["FIT FOR USE", "Allan deviation", "Power of the log over"]);
    place.ok(&format!("validate fitted.toml {LOG} --html validate.html"));
    page(&place, "validate.html", &["EXPLAINED", "fitted.toml", "Autocorrelation"]);
    place.ok(&format!("gap explain rest.toml --fit {LOG} --effect gyro.rate_random_walk --html explain.html"));
    place.ok("study --runs 2 --duration 10 --html study.html");
    assert!(place.read("study.html").contains("THE SLIP MODEL"));
}

#[test]
fn commands_of_a_drive_write_pages_with_its_paths() {
    let place = prepared();
    place.ok("simulate heavy.toml --course brisk --duration 45 --seed 1 -o drive.csv");
    place.run("navigate robot.toml drive.csv --html navigate.html");
    let drive = page(&place, "navigate.html", &["FIT FOR USE", "Paths", "Errors over time", "mean NIS"]);
    assert!(drive.contains("class=\"chart map\""));
    place.ok("gap diagnose robot.toml --fit drive.csv --html gap.html");
    let gap = page(
        &place,
        "gap.html",
        &[
            "Recorded against simulated",
            "Path",
            "recorded less after",
            "payload",
            "How far the gap shrinks",
            "The trail",
        ],
    );
    assert!(gap.contains("class=\"heat\"") || gap.contains("No equation"), "the map of equations is missing");
    place.ok("gap explain robot.toml --fit drive.csv --effect vehicle.payload --html explain.html");
    page(&place, "explain.html", &["FITTED TOGETHER", "payload", "What to do"]);
}

#[test]
fn a_gap_at_rest_has_its_curves_and_what_was_tried() {
    let place = prepared();
    for (name, seed) in [("fit", 11), ("hold", 12)] {
        place.ok(&format!("simulate tone.toml --duration 900 --seed {seed} -o {name}.csv"));
    }
    place.ok("gap diagnose rest.toml --fit fit.csv --hold hold.csv --html gap.html");
    let parts = [
        "IDENTIFIED",
        "Spectrum over frequency",
        "with effects, 95 %",
        "tone",
        "held out",
        "What is left",
        "The trail",
    ];
    let gap = page(&place, "gap.html", &parts);
    assert!(gap.contains("class=\"heat\""), "the map of channel by condition is missing");
}

#[test]
fn a_page_is_replaced_unasked_and_what_is_not_one_s_own_is_not() {
    let place = prepared();
    let line = format!("fit {LOG} --no-plot --html out.html");
    place.ok(&line);
    place.ok(&line);
    place.write("out.html", "<!DOCTYPE html><title>mine</title>");
    place.refused(&line, 1, &["out.html", "gyroid did not write it", "--force"]);
    assert!(place.read("out.html").contains("mine"));
    place.ok(&format!("{line} --force"));
    assert!(!place.read("out.html").contains("mine"));
    place.refused(&format!("fit {LOG} --no-plot --html out.txt"), 2, &["out.txt", "end in .html"]);
    place.refused("fit rest.html --no-plot --html rest.html", 2, &["rest.html"]);
    place.refused(&format!("fit {LOG} --axis x,z --no-plot --html out.html"), 2, &["--html"]);
}
