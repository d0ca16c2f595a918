//! Results of the filters and of dead reckoning over one drive.

use crate::cli::output::Working;
use gyroid::config::Config;
use gyroid::effects::Library;
use gyroid::navigate::{
    ErrorModel, Reckoning, ReferenceErrors, Run, Settings, Summary, dead_reckoning, gyro_reckoning, run_with,
    zeroed_at_start,
};
use gyroid::signal::{Log, names};
use gyroid::vehicle::{Odometry, Rolling};
use gyroid::{Result, progress};
use std::cell::Cell;
use std::rc::Rc;

/// Name of the filter whose gyro was zeroed.
pub(super) const ZEROED: &str = "zeroed at the start";

/// How the filters are asked to run.
#[derive(Clone, Copy)]
pub(super) struct Asked {
    pub settings: Settings,
    /// Whether each pose is given the readings up to it alone.
    pub filtered: bool,
    /// Whether the run without error model is the one that is written.
    pub no_error_model: bool,
}

/// Results of the filters and of dead reckoning over one drive.
pub(super) struct Results {
    asked: Asked,
    /// `None` where the drive has no gyro whose error could be modelled.
    pub with: Option<Run>,
    pub without: Run,
    /// The filter without error model, the gyro zeroed while the robot is at rest at the start; `None` without such a rest.
    pub zeroed: Option<ZeroedRun>,
    /// With the error model where there is a gyro, without the effects; `None` where the configuration has none.
    pub nominal: Option<Run>,
    /// `None` where the wheels tell no yaw rate.
    pub encoders: Option<Reckoning>,
    /// `None` without a gyro.
    pub gyro: Option<Reckoning>,
}

/// A filter without error model over a gyro that was zeroed.
pub(super) struct ZeroedRun {
    pub run: Run,
    pub gyro: Reckoning,
    pub zero_rad_s: f64,
    pub rest_s: f64,
}

/// Whether a drive has readings of a gyro.
pub(super) fn has_gyro(log: &Log) -> bool {
    log.get(names::GYRO_Z).is_some_and(|rates| rates.iter().any(|w| w.is_finite()))
}

impl Results {
    pub(super) fn of(asked: Asked, config: &Config, log: &Log, working: &Working) -> Result<Self> {
        let has_gyro = has_gyro(log);
        let settings = |error_model| Settings { error_model, innovations: false, ..asked.settings };
        // what is written is smoothed, and its innovations are recorded
        let smoothed = |settings, written| Settings {
            smooth: written && !asked.filtered,
            innovations: written && asked.settings.innovations,
            ..settings
        };
        let plain = settings(ErrorModel::Off);
        let effects = Library::new().with_own(config)?;
        let zeroed = zeroed_at_start(config, log)?;
        let filters = 1 + [!config.effects.is_empty(), has_gyro, zeroed.is_some()].into_iter().filter(|f| *f).count();
        let (show, ran) = (Rc::new(working.counter("filters: row".into())), Cell::new(0));
        let filter_over = |config: &Config, log: &Log, settings: &Settings| {
            let (show, before) = (Rc::clone(&show), ran.replace(ran.get() + 1));
            let listener = move |row, rows| show(before * rows + row, filters * rows);
            progress::listened(listener, || run_with(config, log, settings, &effects))
        };
        let filter = |config: &Config, settings: &Settings| filter_over(config, log, settings);
        let bare = Config { effects: Vec::new(), ..config.clone() };
        let without = filter(config, &smoothed(plain, asked.no_error_model || !has_gyro))?;
        let most = if has_gyro { settings(ErrorModel::WarmUp) } else { plain };
        let nominal = if config.effects.is_empty() { None } else { Some(filter(&bare, &most)?) };
        let tick_rad = config.encoder.and_then(|e| e.tick_rad());
        let odometry = Odometry::of(log, &Rolling::new(config.require_vehicle()?), tick_rad);
        let with = if has_gyro { Some(filter(config, &smoothed(most, !asked.no_error_model))?) } else { None };
        let encoders = match odometry.as_ref().and_then(Odometry::wheels) {
            Some(_) => Some(dead_reckoning(config, log, &plain)?),
            None => None,
        };
        let gyro = if has_gyro { Some(gyro_reckoning(config, log, &plain)?) } else { None };
        let zeroed = zeroed.map(|z| -> Result<ZeroedRun> {
            let run = filter_over(&bare, &z.log, &plain)?;
            let gyro = gyro_reckoning(config, &z.log, &plain)?;
            Ok(ZeroedRun { run, gyro, zero_rad_s: z.zero_rad_s, rest_s: z.rest_s })
        });
        Ok(Self { asked, with, without, zeroed: zeroed.transpose()?, nominal, encoders, gyro })
    }

    /// The filter that knows most.
    pub(super) fn best(&self) -> &Run {
        self.with.as_ref().unwrap_or(&self.without)
    }

    /// The run whose pose is written, by which all is judged.
    pub(super) fn written(&self) -> &Run {
        if self.asked.no_error_model { &self.without } else { self.best() }
    }

    /// All that ran, by name: errors, and for filters the summary.
    pub(super) fn rows(&self) -> Vec<(&'static str, Option<&ReferenceErrors>, Option<&Summary>)> {
        let mut filters = match &self.with {
            Some(with) => vec![("with error model", with), ("without error model", &self.without)],
            None => vec![("filter, no gyro", &self.without)],
        };
        if let Some(nominal) = &self.nominal {
            filters.insert(1, ("without the effects", nominal));
        }
        if let Some(zeroed) = &self.zeroed {
            filters.push((ZEROED, &zeroed.run));
        }
        let smoothed = filters.iter().find_map(|(_, r)| r.smoothed.as_ref());
        let smoothed = smoothed.map(|s| ("smoothed", s.reference.as_ref(), None));
        let filters = filters.into_iter().map(|(name, r)| (name, r.summary.reference.as_ref(), Some(&r.summary)));
        let reckoned = self.reckoned().into_iter().map(|(name, r)| (name, r.reference.as_ref(), None));
        filters.chain(smoothed).chain(reckoned).collect()
    }

    /// Reckonings without a filter, by name.
    pub(super) fn reckoned(&self) -> Vec<(&'static str, &Reckoning)> {
        let zeroed = self.zeroed.as_ref().map(|z| &z.gyro);
        let all = [
            ("encoders alone", self.encoders.as_ref()),
            ("gyro zeroed, alone", zeroed),
            ("gyro as it is", self.gyro.as_ref()),
        ];
        all.into_iter().filter_map(|(name, r)| Some((name, r?))).collect()
    }

    pub(super) fn json(&self, notes: &[String]) -> serde_json::Value {
        let written = self.written();
        let reckoned = |r: &Option<Reckoning>| r.as_ref().map(|r| serde_json::json!({ "reference": r.reference }));
        serde_json::json!({
            "fit_for_use": written.summary.consistency.fit_for_use,
            "smoothed": written.smoothed.as_ref().map(|s| serde_json::json!({ "reference": s.reference })),
            "with_error_model": self.with.as_ref().map(|r| &r.summary),
            "without_error_model": self.without.summary,
            "zeroed_at_start": self.zeroed.as_ref().map(|z| serde_json::json!({
                "zero_rad_s": z.zero_rad_s,
                "rest_s": z.rest_s,
                "filter": z.run.summary,
                "gyro_reckoning": { "reference": z.gyro.reference },
            })),
            "without_effects": self.nominal.as_ref().map(|r| &r.summary),
            "dead_reckoning": reckoned(&self.encoders),
            "gyro_reckoning": reckoned(&self.gyro),
            "log_notes": notes,
        })
    }
}
