//! The second thread: diagnostics, the state file and the configuration, so that no sample waits for them.

use super::diagnostics;
use super::messages::DiagnosticArray;
use super::options::{Options, Signals, boot_id};
use super::report::Report;
use crate::config::Config;
use crate::error::Result;
use crate::live::{Corrector, Start};
use ros2_client::Publisher;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::{Duration, SystemTime};

/// How often files are looked at.
const LOOK: Duration = Duration::from_millis(200);

/// Time between two writings of the state file, s: a sudden end loses so much of the warm-up's age.
const KEEP_EVERY_S: f64 = 10.0;

/// Keeps files and diagnostics.
pub(super) struct Keeper<'a> {
    options: &'a Options,
    signals: &'a Signals,
    publisher: Publisher<DiagnosticArray>,
    say: &'a mut (dyn FnMut(&str) + Send),
    reports: Receiver<Report>,
    correctors: SyncSender<Box<Corrector>>,
    /// When the configuration's file was last changed.
    changed: Option<SystemTime>,
    /// Why the configuration as it stands is not used.
    refused: Option<String>,
    last: Option<Report>,
    kept_s: f64,
}

fn changed(path: &Path) -> Option<SystemTime> {
    std::fs::metadata(path).and_then(|m| m.modified()).ok()
}

impl<'a> Keeper<'a> {
    /// The keeper, and the loop's ends of the channels to and from it.
    pub(super) fn new(
        options: &'a Options,
        signals: &'a Signals,
        publisher: Publisher<DiagnosticArray>,
        say: &'a mut (dyn FnMut(&str) + Send),
    ) -> (Self, SyncSender<Report>, Receiver<Box<Corrector>>) {
        let (report, reports) = sync_channel(4);
        let (correctors, renewed) = sync_channel(1);
        let keeper = Self {
            options,
            signals,
            publisher,
            say,
            reports,
            correctors,
            changed: changed(&options.config),
            refused: None,
            last: None,
            kept_s: 0.0,
        };
        (keeper, report, renewed)
    }

    /// Until nobody reports any more.
    pub(super) fn run(mut self) -> Result<()> {
        loop {
            match self.reports.recv_timeout(LOOK) {
                Ok(report) => self.reported(report),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return self.keep(),
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
        let status = diagnostics::status(self.options, &report, self.last.as_ref(), self.refused.as_deref());
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

    /// Reads the configuration anew and hands the loop a corrector that goes on where the last report was.
    fn reload(&mut self) {
        match self.renewed() {
            Ok(Some((corrector, notes))) => {
                self.refused = None;
                // while nothing arrives the loop takes none up
                if self.correctors.try_send(Box::new(corrector)).is_err() {
                    return self.signals.reload.store(true, Ordering::Relaxed);
                }
                (self.say)(&format!("{} was read again", self.options.config.display()));
                notes.iter().for_each(|note| (self.say)(note));
            }
            // nothing has come yet
            Ok(None) => self.signals.reload.store(true, Ordering::Relaxed),
            Err(error) => {
                (self.say)(&format!("{error}; the node goes on with what it read before"));
                self.refused = Some(error.to_string());
            }
        }
    }

    fn renewed(&self) -> Result<Option<(Corrector, Vec<String>)>> {
        let config = Config::read(&self.options.config)?;
        let Some(before) = self.last.as_ref().and_then(|r| r.corrector.as_ref()) else { return Ok(None) };
        let saved = before.saved("this boot");
        let (stamp_ns, arrival_s) = before.last_sample();
        let start = Start { stamp_ns, arrival_s, saved: Some(&saved), boot_id: "this boot", ..Start::default() };
        Corrector::new(&config, self.options.settings(), &start).map(Some)
    }
}
