use super::claims::Status;
use super::*;
use crate::config::Config;
use crate::identify::{FitOptions, fit};
use crate::report::LogFacts;
use crate::signal::names;
use crate::simulate::{Course, Options, stationary};
use crate::study::{DEFAULT_CONFIG, by_ground, study, wrong_beliefs};
use crate::traction::Surface;
use crate::units::RateUnit;
use crate::validate;
use std::collections::BTreeMap;

/// A short study on ice, with a fit of a short log at rest.
fn report(runs: usize, estimators: &[Estimator]) -> StudyReport {
    let config = Config::parse(DEFAULT_CONFIG, "study.toml").unwrap();
    let base = Setup::new(config.clone(), Course::Square).on(Surface::Ice);
    let setup = Setup { runs, duration_s: 4.0, estimators: estimators.to_vec(), ..base };
    let rest = Config { sample_time_s: Some(1.0), ..config };
    let log = stationary(&rest, 1200.0, &Options::from(1)).unwrap();
    let rate = log.require(names::GYRO_Z).unwrap();
    let fit = fit(&log.time, rate, &FitOptions::default()).unwrap();
    let residuals = fit.residuals(&log.time, rate);
    let options = validate::Options { draws: 99, ..validate::Options::default() };
    let validation = validate::whiteness(&log.time, &residuals, &fit.jacobian(&log.time), &options);
    let facts = LogFacts {
        name: "rest.csv".into(),
        column: names::GYRO_Z.into(),
        unit: RateUnit::RadPerS,
        sha256: String::new(),
        temperature_c: None,
        notes: Vec::new(),
        audit: Value::Null,
    };
    StudyReport {
        robot: "robot.toml".into(),
        ground: "ice".into(),
        identification: FitReport::new(facts, fit, validation),
        study: study(&setup, |_| {}).unwrap(),
        longer: None,
        grounds: Vec::new(),
        beliefs: Vec::new(),
        setup,
    }
}

#[test]
fn every_equation_and_figure_has_one_row_and_every_row_its_words() {
    let report = report(3, &Estimator::ALL);
    let claims = report.claims();
    let mut places = BTreeMap::new();
    claims.iter().for_each(|c| *places.entry(c.place).or_insert(0) += 1);
    let equations = ["(1)", "(2)", "(3)", "(4)"].map(String::from);
    let dynamics = ('a'..='j').map(|letter| format!("(5{letter})"));
    let figures = (1..=7).map(|i| format!("Figure {i}"));
    for place in equations.into_iter().chain(dynamics).chain(figures) {
        assert_eq!(places.get(place.as_str()), Some(&1), "{place}");
    }
    for section in 1..=6 {
        assert!(places.contains_key(format!("Section {section}").as_str()), "{section}");
    }
    for c in &claims {
        assert!(!c.says.is_empty() && !c.here.is_empty(), "{c:?}");
        assert!(!c.here.contains("NaN") && !c.here.contains("unknown") && !c.here.contains('\n'), "{c:?}");
    }
    // the example of the lateral constraint: straight on for 5 m against a circle of 1 m radius, 5 rad far
    let apart = (5.0f64.sin() - 5.0).hypot(1.0 - 5.0f64.cos());
    let row = claims.iter().find(|c| c.place == "(5e)").unwrap();
    assert!(row.here.contains(&format!("{apart:.1} m apart")), "{}", row.here);
    let page = report.page();
    let table = page.split("row by row").nth(1).unwrap();
    assert_eq!(table.lines().filter(|l| l.starts_with('|')).count(), claims.len() + 2);
    assert!(table.lines().filter(|l| l.starts_with('|')).all(|l| l.replace("\\|", "").matches('|').count() == 5));
}

#[test]
fn the_status_of_what_is_measured_follows_the_measurement() {
    let mut report = report(4, &Estimator::ALL);
    for (scale, status) in [(0.01, Status::Reproduced), (100.0, Status::NotReproducible)] {
        let rolling = report.study.of(Estimator::Rolling).unwrap().run_rms.clone();
        let slip = report.study.estimators.iter_mut().find(|e| e.estimator == Estimator::Slip).unwrap();
        slip.run_rms = rolling.iter().map(|r| r.map(|v| scale * v)).collect();
        let claims = report.claims();
        for place in ["Figure 3", "Figure 4", "Section 6"] {
            let row = claims.iter().find(|c| c.place == place).unwrap();
            assert_eq!(row.status, status, "{row:?}");
        }
        assert_eq!(report.won_in_all(), if scale < 1.0 { 1.0 } else { 0.0 });
    }
    report.identification.validation.white = false;
    let row = report.claims().into_iter().find(|c| c.place == "Figure 2").unwrap();
    assert_eq!(row.status, Status::NotReproducible);
}

#[test]
fn figures_have_the_names_that_were_claimed_with_sweeps_and_without() {
    let mut report = report(2, &Estimator::ALL);
    let names = |report: &StudyReport| report.figures().unwrap().iter().map(|f| f.0).collect::<Vec<_>>();
    assert_eq!(names(&report), StudyReport::figure_names(false));
    let few = Setup { estimators: Estimator::FILTERS.to_vec(), ..report.setup.clone() };
    report.grounds = by_ground(&few, |_| {}).unwrap();
    report.beliefs = wrong_beliefs(&few, |_| {}).unwrap();
    assert_eq!(names(&report), StudyReport::figure_names(true));
    let page = report.page();
    for name in StudyReport::figure_names(true) {
        assert!(page.contains(&format!("({name}.png)")), "{name}");
    }
    for heading in ["## Other grounds", "wet cobblestone", "## A filter that is wrong about traction"] {
        assert!(page.contains(heading), "{heading}");
    }
}

#[test]
fn one_run_and_one_estimator_are_enough_for_a_report() {
    for estimators in [&[Estimator::DeadReckoning][..], &[Estimator::Slip], &Estimator::ALL] {
        let report = report(1, estimators);
        assert_eq!(report.figures().unwrap().len(), StudyReport::figure_names(false).len());
        assert!(report.text().contains(estimators[0].words()));
        assert!(!report.page().contains("NaN"));
        assert_eq!(report.json()["runs"], 1);
    }
}

#[test]
fn the_json_is_that_of_the_study() {
    let report = report(2, &Estimator::ALL);
    let json = report.json();
    for e in &report.study.estimators {
        for (i, quantity) in QUANTITIES.iter().enumerate() {
            assert_eq!(json["rms"][e.estimator.id()][quantity].as_f64(), Some(e.rms[i]));
        }
    }
    let times = json["over_time"]["time_s"].as_array().unwrap().len();
    assert_eq!(json["over_time"]["rms"]["slip"]["x_m"].as_array().unwrap().len(), times);
    assert_eq!(json["example"]["slip_left"]["std"].as_array().unwrap().len(), times);
    assert_eq!(json["claims"].as_array().unwrap().len(), report.claims().len());
}
