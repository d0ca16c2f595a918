//! The second thread: diagnostics, the state file, the configuration and the parameters, so that no sample waits for them.

use super::diagnostics;
use super::messages::DiagnosticArray;
use super::options::{Options, Signals, boot_id};
use super::parameters::{self, CONFIG};
use super::report::Report;
use super::services::{Keeps, Services};
use crate::config::Config;
use crate::error::Result;
use crate::live::{Corrector, Start};
use ros2_client::Publisher;
use ros2_client::parameters::raw::Parameter;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::{Duration, SystemTime};

/// How often files and requests are looked at.
const LOOK: Duration = Duration::from_millis(200);

/// Time between two writings of the state file, s: a sudden end loses so much of the warm-up's age.
const KEEP_EVERY_S: f64 = 10.0;

/// Keeps files and diagnostics.
pub(super) struct Keeper<'a> {
    /// As the parameters have them now.
    options: Options,
    /// As it was last read without an error.
    config: Config,
    signals: &'a Signals,
    publisher: Publisher<DiagnosticArray>,
    say: &'a mut (dyn FnMut(&str) + Send),
    reports: Receiver<Report>,
    correctors: SyncSender<Box<Corrector>>,
    /// When the configuration's file was last changed.
    changed: Option<SystemTime>,
    /// Why the configuration as it stands is not used.
    refused: Option<String>,
    /// The loop has not yet been handed a corrector by these options.
    waits: bool,
    last: Option<Report>,
    kept_s: f64,
}

fn changed(path: &Path) -> Option<SystemTime> {
    std::fs::metadata(path).and_then(|m| m.modified()).ok()
}

impl<'a> Keeper<'a> {
    /// The keeper, and the loop's ends of the channels to and from it.
    pub(super) fn new(
        (options, config): (&Options, &Config),
        signals: &'a Signals,
        publisher: Publisher<DiagnosticArray>,
        say: &'a mut (dyn FnMut(&str) + Send),
    ) -> (Self, SyncSender<Report>, Receiver<Box<Corrector>>) {
        let (report, reports) = sync_channel(4);
        let (correctors, renewed) = sync_channel(1);
        let keeper = Self {
            options: options.clone(),
            config: config.clone(),
            signals,
            publisher,
            say,
            reports,
            correctors,
            changed: changed(&options.config),
            refused: None,
            waits: false,
            last: None,
            kept_s: 0.0,
        };
        (keeper, report, renewed)
    }

    /// Until nobody reports any more.
    pub(super) fn run(mut self, services: &Services) -> Result<()> {
        loop {
            match self.reports.recv_timeout(LOOK) {
                Ok(report) => self.reported(report),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return self.keep(),
            }
            services.answer(&mut self);
            if self.waits {
                // it was possible with the same options before
                let _ = self.take_over(self.options.clone(), self.config.clone());
            }
            let now = changed(&self.options.config);
            if self.signals.reload.swap(false, Ordering::Relaxed) || (now.is_some() && now != self.changed) {
                self.changed = now;
                self.reload();
            }
        }
    }

    fn reported(&mut self, report: Report) {
        report.notes.iter().for_each(|note| (self.say)(note));
        let status = diagnostics::status(&self.options, &report, self.last.as_ref(), self.refused.as_deref());
        // who does not listen misses it
        let _ = self.publisher.publish(status);
        let now_s = report.now_s;
        self.last = Some(report);
        if now_s - self.kept_s >= KEEP_EVERY_S {
            self.kept_s = now_s;
            if let Err(error) = self.keep() {
                (self.say)(&error.to_string());
            }
        }
    }

    fn keep(&self) -> Result<()> {
        let (Some(path), Some(corrector)) =
            (&self.options.state, self.last.as_ref().and_then(|r| r.corrector.as_ref()))
        else {
            return Ok(());
        };
        corrector.saved(&boot_id()).write(path)
    }

    /// Reads the configuration anew.
    fn reload(&mut self) {
        match Config::read(&self.options.config).and_then(|config| self.take_over(self.options.clone(), config)) {
            Ok(()) => {
                self.refused = None;
                (self.say)(&format!("{} was read again", self.options.config.display()));
            }
            Err(error) => {
                (self.say)(&format!("{error}; the node goes on with what it read before"));
                self.refused = Some(error.to_string());
            }
        }
    }

    /// Hands the loop a corrector by `options` and `config` that goes on where the last report was.
    fn take_over(&mut self, options: Options, config: Config) -> Result<()> {
        let before = self.last.as_ref().and_then(|r| r.corrector.as_ref());
        let saved = before.map(|b| b.saved("this boot"));
        let (stamp_ns, arrival_s) = before.map_or((0, 0.0), Corrector::last_sample);
        let start = Start { stamp_ns, arrival_s, saved: saved.as_ref(), boot_id: "this boot", ..Start::default() };
        let (corrector, notes) = Corrector::new(&config, options.settings(), &start)?;
        // while nothing arrives the loop takes none up, and before the first sample it has none to replace
        self.waits = before.is_none() || self.correctors.try_send(Box::new(corrector)).is_err();
        if !self.waits {
            notes.iter().for_each(|note| (self.say)(note));
        }
        (self.options, self.config) = (options, config);
        Ok(())
    }
}

impl Keeps for Keeper<'_> {
    fn options(&self) -> &Options {
        &self.options
    }

    fn set(&mut self, wanted: &[Parameter]) -> std::result::Result<(), String> {
        let options = parameters::changed(&self.options, wanted)?;
        let read = wanted.iter().any(|p| p.name == CONFIG);
        // before it is read: a change that comes meanwhile is seen at the next look
        let seen = changed(&options.config);
        let config = if read { Config::read(&options.config) } else { Ok(self.config.clone()) };
        config.and_then(|config| self.take_over(options, config)).map_err(|e| e.to_string())?;
        if read {
            (self.changed, self.refused) = (seen, None);
        }
        let names: Vec<_> = wanted.iter().map(|p| p.name.as_str()).collect();
        (self.say)(&format!("set by a request: {}", names.join(", ")));
        Ok(())
    }
}
