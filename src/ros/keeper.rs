//! The second thread: diagnostics, the state file, the configuration and the parameters, so that no sample waits for them.

use super::diagnostics;
use super::messages::DiagnosticArray;
use super::options::{Options, Signals, boot_id};
use super::parameters;
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

/// The loop's end of the channel to the keeper.
pub(super) type Reports = SyncSender<Report>;

/// The loop's end of the channel from the keeper: correctors by the gyro.
pub(super) type Correctors = Receiver<(usize, Box<Corrector>)>;

/// Keeps files and diagnostics.
pub(super) struct Keeper<'a> {
    /// As the parameters have them now.
    options: Options,
    gyros: Vec<Gyro>,
    signals: &'a Signals,
    publisher: Publisher<DiagnosticArray>,
    say: &'a mut (dyn FnMut(&str) + Send),
    reports: Receiver<Report>,
    correctors: SyncSender<(usize, Box<Corrector>)>,
    last: Option<Report>,
    kept_s: f64,
}

/// The configuration of a gyro.
struct Gyro {
    /// As it was last read without an error.
    config: Config,
    /// When its file was last changed.
    changed: Option<SystemTime>,
    /// Why the file as it stands is not used.
    refused: Option<String>,
    /// The loop has not yet been handed a corrector by it and the options.
    waits: bool,
}

fn changed(path: &Path) -> Option<SystemTime> {
    std::fs::metadata(path).and_then(|m| m.modified()).ok()
}

impl<'a> Keeper<'a> {
    /// The keeper, and the loop's ends of the channels to and from it.
    pub(super) fn new(
        (options, configs): (&Options, Vec<Config>),
        signals: &'a Signals,
        publisher: Publisher<DiagnosticArray>,
        say: &'a mut (dyn FnMut(&str) + Send),
    ) -> (Self, Reports, Correctors) {
        let (report, reports) = sync_channel(4);
        let (correctors, renewed) = sync_channel(configs.len());
        let gyros = options.gyros.iter().zip(configs).map(|(gyro, config)| Gyro {
            config,
            changed: changed(&gyro.config),
            refused: None,
            waits: false,
        });
        let keeper = Self {
            options: options.clone(),
            gyros: gyros.collect(),
            signals,
            publisher,
            say,
            reports,
            correctors,
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
            let all = self.signals.reload.swap(false, Ordering::Relaxed);
            for k in 0..self.gyros.len() {
                if self.gyros[k].waits {
                    // it was possible with the same options before
                    let _ = self.take_over(self.options.clone(), vec![(k, self.gyros[k].config.clone())]);
                }
                let now = changed(&self.options.gyros[k].config);
                if all || (now.is_some() && now != self.gyros[k].changed) {
                    self.gyros[k].changed = now;
                    self.reload(k);
                }
            }
        }
    }

    fn reported(&mut self, report: Report) {
        report.notes.iter().for_each(|note| (self.say)(note));
        let refused = self.gyros.iter().map(|gyro| gyro.refused.as_deref());
        let status = diagnostics::status(&self.options, &report, self.last.as_ref(), refused);
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
        for (k, gyro) in self.options.gyros.iter().enumerate() {
            if let (Some(path), Some(corrector)) = (self.options.state_file(gyro.axis), self.corrector(k)) {
                corrector.saved(&boot_id()).write(&path)?;
            }
        }
        Ok(())
    }

    /// The corrector of gyro `k` in the last report.
    fn corrector(&self, k: usize) -> Option<&Corrector> {
        self.last.as_ref()?.gyros[k].as_ref().map(|gyro| &gyro.corrector)
    }

    /// Reads the configuration of gyro `k` anew.
    fn reload(&mut self, k: usize) {
        let file = self.options.gyros[k].config.clone();
        match Config::read(&file).and_then(|config| self.take_over(self.options.clone(), vec![(k, config)])) {
            Ok(()) => {
                self.gyros[k].refused = None;
                (self.say)(&format!("{} was read again", file.display()));
            }
            Err(error) => {
                (self.say)(&format!("{error}; the node goes on with what it read before"));
                self.gyros[k].refused = Some(error.to_string());
            }
        }
    }

    /// Hands the loop correctors by `options` and the configurations of some gyros, that go on where the last report was.
    fn take_over(&mut self, options: Options, configs: Vec<(usize, Config)>) -> Result<()> {
        let mut made = Vec::new();
        for (k, config) in configs {
            let before = self.corrector(k);
            let saved = before.map(|b| b.saved("this boot"));
            let (stamp_ns, arrival_s) = before.map_or((0, 0.0), Corrector::last_sample);
            let start = Start { stamp_ns, arrival_s, saved: saved.as_ref(), boot_id: "this boot", ..Start::default() };
            let (corrector, notes) = Corrector::new(&config, options.settings(), &start)?;
            made.push((k, config, corrector, notes));
        }
        self.options = options;
        for (k, config, corrector, notes) in made {
            // while nothing arrives the loop takes none up, and before the first sample it has none to replace
            let waits = self.corrector(k).is_none() || self.correctors.try_send((k, Box::new(corrector))).is_err();
            if !waits {
                notes.iter().for_each(|note| (self.say)(note));
            }
            (self.gyros[k].config, self.gyros[k].waits) = (config, waits);
        }
        Ok(())
    }
}

impl Keeps for Keeper<'_> {
    fn options(&self) -> &Options {
        &self.options
    }

    fn set(&mut self, wanted: &[Parameter]) -> std::result::Result<(), String> {
        let options = parameters::changed(&self.options, wanted)?;
        let read: Vec<_> = wanted.iter().filter_map(|p| parameters::config_of(&options, &p.name)).collect();
        // before they are read: a change that comes meanwhile is seen at the next look
        let seen: Vec<_> = read.iter().map(|k| changed(&options.gyros[*k].config)).collect();
        // the other parameters are those of all gyros
        let configs = self.gyros.iter().enumerate().filter(|(k, _)| read.len() < wanted.len() || read.contains(k));
        let configs = configs.map(|(k, gyro)| {
            let config =
                if read.contains(&k) { Config::read(&options.gyros[k].config) } else { Ok(gyro.config.clone()) };
            config.map(|config| (k, config))
        });
        let configs = configs.collect::<Result<Vec<_>>>();
        configs.and_then(|configs| self.take_over(options, configs)).map_err(|e| e.to_string())?;
        for (k, seen) in read.into_iter().zip(seen) {
            (self.gyros[k].changed, self.gyros[k].refused) = (seen, None);
        }
        let names: Vec<_> = wanted.iter().map(|p| p.name.as_str()).collect();
        (self.say)(&format!("set by a request: {}", names.join(", ")));
        Ok(())
    }
}
