//! The third thread, where a recording was asked for: what arrived and what was published, to MCAP.

use super::messages::{Imu, JointState, Odometry, Temperature, TwistWithCovarianceStamped};
use super::options::{BIAS, Options};
use crate::error::{Error, ErrorKind, Result};
use crate::report::mcap::{Stream, Topic};
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Messages that may wait for the disk: two seconds at 1 kHz.
const WAITING: usize = 4096;
/// Joint states and odometry are larger and fewer.
const WHEELS_WAITING: usize = 256;

/// How often the file is handed to the system: a sudden end loses so much.
const FLUSH: Duration = Duration::from_secs(1);

/// A message, which comes with the time of its receipt, ns since the epoch.
#[derive(Clone, Copy)]
enum Record {
    Raw(Imu),
    Corrected(Imu),
    Bias(TwistWithCovarianceStamped),
    Temperature(Temperature),
}

/// The loop's end: gives messages on, and counts those that the disk is too slow for.
pub(super) struct Tape {
    records: SyncSender<(u64, Record)>,
    joints: SyncSender<(u64, JointState)>,
    odometry: SyncSender<(u64, Odometry)>,
    pub lost: u64,
}

impl Tape {
    pub(super) fn raw(&mut self, message: Imu) {
        self.put(Record::Raw(message));
    }

    pub(super) fn corrected(&mut self, message: Imu) {
        self.put(Record::Corrected(message));
    }

    pub(super) fn bias(&mut self, message: TwistWithCovarianceStamped) {
        self.put(Record::Bias(message));
    }

    pub(super) fn temperature(&mut self, message: Temperature) {
        self.put(Record::Temperature(message));
    }

    pub(super) fn joints(&mut self, message: JointState) {
        self.lost += u64::from(self.joints.try_send((now_ns(), message)).is_err());
    }

    pub(super) fn odometry(&mut self, message: Odometry) {
        self.lost += u64::from(self.odometry.try_send((now_ns(), message)).is_err());
    }

    fn put(&mut self, record: Record) {
        self.lost += u64::from(self.records.try_send((now_ns(), record)).is_err());
    }
}

fn now_ns() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}

struct Topics {
    raw: Topic<Imu>,
    corrected: Topic<Imu>,
    bias: Topic<TwistWithCovarianceStamped>,
    temperature: Topic<Temperature>,
    joints: Topic<JointState>,
    odometry: Topic<Odometry>,
}

/// Writes the file.
pub(super) struct Recorder<'a> {
    path: &'a Path,
    stream: Stream<BufWriter<File>>,
    topics: Topics,
    records: Receiver<(u64, Record)>,
    joints: Receiver<(u64, JointState)>,
    odometry: Receiver<(u64, Odometry)>,
}

impl<'a> Recorder<'a> {
    /// Begins `path`, which must not be there yet; and the loop's end.
    ///
    /// # Errors
    /// [`ErrorKind::Exists`] where there is such a file, [`ErrorKind::Io`] where none can be made.
    pub(super) fn new(path: &'a Path, options: &Options) -> Result<(Self, Tape)> {
        let file = File::options().write(true).create_new(true).open(path).map_err(|e| match e.kind() {
            io::ErrorKind::AlreadyExists => Error::new(ErrorKind::Exists, path.display(), "is there already")
                .at("--record")
                .hint("name another file: a recording replaces none"),
            _ => Error::io(path, &e),
        })?;
        let topics = &options.topics;
        let names = [
            topics.imu.as_str(),
            &topics.out,
            BIAS,
            topics.temperature.as_deref().unwrap_or("temperature"),
            topics.joints.as_deref().unwrap_or("joint_states"),
            topics.odometry.as_deref().unwrap_or("odom"),
        ];
        let [raw, corrected, bias, temperature, joints, odometry] = names.map(|topic| options.absolute(topic));
        let begun = |file| -> io::Result<(Stream<_>, Topics)> {
            let mut stream = Stream::without_index(file)?;
            let topics = Topics {
                raw: stream.topic(&raw)?,
                corrected: stream.topic(&corrected)?,
                bias: stream.topic(&bias)?,
                temperature: stream.topic(&temperature)?,
                joints: stream.topic(&joints)?,
                odometry: stream.topic(&odometry)?,
            };
            Ok((stream, topics))
        };
        let (stream, topics) = begun(BufWriter::new(file)).map_err(|e| Error::io(path, &e))?;
        let (record, records) = sync_channel(WAITING);
        let (joint, joints) = sync_channel(WHEELS_WAITING);
        let (odometry, heard) = sync_channel(WHEELS_WAITING);
        let tape = Tape { records: record, joints: joint, odometry, lost: 0 };
        Ok((Self { path, stream, topics, records, joints, odometry: heard }, tape))
    }

    /// Until nobody gives messages any more.
    pub(super) fn run(mut self) -> Result<()> {
        let path = self.path;
        self.write().and_then(|()| self.stream.finish().map(drop)).map_err(|e| Error::io(path, &e))
    }

    fn write(&mut self) -> io::Result<()> {
        let mut flushed = std::time::Instant::now();
        loop {
            let next = self.records.recv_timeout(FLUSH);
            while let Ok((ns, message)) = self.joints.try_recv() {
                self.stream.put(&self.topics.joints, ns, &message)?;
            }
            while let Ok((ns, message)) = self.odometry.try_recv() {
                self.stream.put(&self.topics.odometry, ns, &message)?;
            }
            match next {
                Ok((ns, Record::Raw(message))) => self.stream.put(&self.topics.raw, ns, &message)?,
                Ok((ns, Record::Corrected(message))) => self.stream.put(&self.topics.corrected, ns, &message)?,
                Ok((ns, Record::Bias(message))) => self.stream.put(&self.topics.bias, ns, &message)?,
                Ok((ns, Record::Temperature(message))) => self.stream.put(&self.topics.temperature, ns, &message)?,
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
            }
            if flushed.elapsed() >= FLUSH {
                flushed = std::time::Instant::now();
                self.stream.flush()?;
            }
        }
    }
}
