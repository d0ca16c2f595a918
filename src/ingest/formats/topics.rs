//! Logs that hold messages of several topics: which are there, and which one is read.

use super::head::Head;
use super::source::{About, Source};
use crate::error::{Error, ErrorKind, Result};
use crate::ingest::columns::names::Role;
use serde::Serialize;

/// Which of the two times of a message counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Stamp {
    /// The time in the message: when the sensor was read.
    #[default]
    Header,
    /// The time at which the recorder received or stored the message.
    Receipt,
}

/// The messages of one name in a log.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Topic {
    /// Name: `/imu/data`, `sensor_gyro/0`, `IMU/1`.
    pub name: String,
    /// The format's name of the message type.
    pub type_name: String,
    /// How many messages there are.
    pub messages: u64,
    /// Messages less one over the time from the first to the last, Hz; none with fewer than two.
    pub rate_hz: Option<f64>,
    /// Whether the messages hold the rates of a gyro.
    pub gyro: bool,
}

/// Times of the messages of a topic, while they are counted.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Count {
    pub messages: u64,
    first_ns: i64,
    last_ns: i64,
}

impl Count {
    /// One more message.
    pub(crate) fn add(&mut self, time_ns: i64) {
        if self.messages == 0 {
            (self.first_ns, self.last_ns) = (time_ns, time_ns);
        }
        self.messages += 1;
        self.first_ns = self.first_ns.min(time_ns);
        self.last_ns = self.last_ns.max(time_ns);
    }

    /// The messages of another publisher beside these.
    pub(crate) fn join(&mut self, other: Self) {
        if self.messages == 0 {
            *self = other;
        } else if other.messages > 0 {
            self.messages += other.messages;
            self.first_ns = self.first_ns.min(other.first_ns);
            self.last_ns = self.last_ns.max(other.last_ns);
        }
    }

    /// All messages at once.
    #[cfg(feature = "db3")]
    pub(crate) fn of(messages: u64, first_ns: i64, last_ns: i64) -> Self {
        Self { messages, first_ns, last_ns }
    }

    pub(crate) fn rate_hz(&self) -> Option<f64> {
        let span_s = (i128::from(self.last_ns) - i128::from(self.first_ns)) as f64 * 1e-9;
        (self.messages >= 2 && span_s > 0.0).then(|| (self.messages - 1) as f64 / span_s)
    }
}

/// Contents of a file with topics.
#[derive(Debug, Clone)]
pub(crate) struct Listing {
    /// The file; its notes are what was found when the topics were listed.
    pub about: About,
    /// The topics in the order of their names.
    pub topics: Vec<Topic>,
}

impl Listing {
    /// Messages of the topic called `name`.
    pub(crate) fn messages(&self, name: &str) -> Option<u64> {
        self.topics.iter().find(|t| t.name == name).map(|t| t.messages)
    }
}

/// A file with topics.
pub(crate) trait Container {
    /// The file and its topics.
    fn listing(&self) -> &Listing;
    /// The messages of one of [`Listing::topics`] as a table.
    fn open(self: Box<Self>, topic: usize, stamp: Stamp) -> Result<Box<dyn Source>>;
}

/// Whether columns hold a gyro's rates.
pub(crate) fn has_gyro(heads: &[Head]) -> bool {
    heads.iter().any(|h| matches!(h.named().role, Role::Gyro(_)))
}

/// The topics in a sentence: name, type, messages.
pub(crate) fn list(topics: &[Topic]) -> String {
    const MOST: usize = 40;
    let one = |t: &Topic| format!("{} ({}, {} messages)", t.name, t.type_name, t.messages);
    let mut names: Vec<String> = topics.iter().take(MOST).map(one).collect();
    if topics.len() > MOST {
        names.push(format!("and {} more", topics.len() - MOST));
    }
    if names.is_empty() { "none".to_string() } else { names.join(", ") }
}

/// The topic that is `wanted`, or the only one with a gyro; with what there is to tell.
pub(crate) fn choose(source: &str, topics: &[Topic], wanted: Option<&str>) -> Result<(usize, Option<String>)> {
    match wanted {
        Some(name) => named(source, topics, name).map(|i| (i, None)),
        None => only(source, topics),
    }
}

/// A name as written, without its leading slash, without regard to case, or without its only instance.
fn named(source: &str, topics: &[Topic], name: &str) -> Result<usize> {
    let bare = |n: &str| n.trim().trim_start_matches('/').to_lowercase();
    let stem = |n: &str| bare(n.rsplit_once('/').map_or(n, |(stem, _)| stem));
    let all =
        |same: &dyn Fn(&Topic) -> bool| -> Vec<usize> { (0..topics.len()).filter(|&i| same(&topics[i])).collect() };
    let instance = |t: &Topic| t.name.rsplit_once('/').is_some_and(|(_, n)| n.parse::<u32>().is_ok());
    let tries = [
        all(&|t| t.name == name),
        all(&|t| bare(&t.name) == bare(name)),
        all(&|t| instance(t) && stem(&t.name) == bare(name)),
    ];
    match tries.into_iter().find(|found| !found.is_empty()).as_deref() {
        Some([one]) => Ok(*one),
        Some(several) => {
            let names: Vec<_> = several.iter().map(|&i| topics[i].name.as_str()).collect();
            let found = format!("several topics are called {name:?}: {}", names.join(", "));
            Err(Error::new(ErrorKind::Column, source, found).hint(format!("name one: --topic {}", names[0])))
        }
        None => {
            let found = format!("no topic {name:?}; there are {}", list(topics));
            Err(Error::new(ErrorKind::Column, source, found).hint("name one of them with --topic"))
        }
    }
}

/// Indices of the topics with messages of a gyro.
pub(crate) fn with_gyro(source: &str, topics: &[Topic]) -> Result<Vec<usize>> {
    let gyros: Vec<usize> = (0..topics.len()).filter(|&i| topics[i].gyro && topics[i].messages > 0).collect();
    if gyros.is_empty() {
        let found = format!("no topic holds a gyro; there are {}", list(topics));
        return Err(Error::new(ErrorKind::Column, source, found)
            .hint("record the IMU's topic, or name the topic that holds the rates with --topic"));
    }
    Ok(gyros)
}

fn only(source: &str, topics: &[Topic]) -> Result<(usize, Option<String>)> {
    let gyros = with_gyro(source, topics)?;
    match gyros[..] {
        [one] => {
            let Topic { name, type_name, .. } = &topics[one];
            Ok((one, Some(format!("topic {name} ({type_name}) is read: the only one with a gyro"))))
        }
        _ => {
            let there: Vec<Topic> = gyros.iter().map(|&i| topics[i].clone()).collect();
            let found = format!("several topics hold a gyro: {}", list(&there));
            let hint = format!("name one: --topic {}; gyroid fit --topic all fits each of them", there[0].name);
            Err(Error::new(ErrorKind::Column, source, found).hint(hint))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn topics(all: &[(&str, u64, bool)]) -> Vec<Topic> {
        let topic = |&(name, messages, gyro): &(&str, u64, bool)| Topic {
            name: name.to_string(),
            type_name: "T".to_string(),
            messages,
            rate_hz: None,
            gyro,
        };
        all.iter().map(topic).collect()
    }

    #[test]
    fn the_only_gyro_is_taken_and_said() {
        let (one, note) =
            choose("f", &topics(&[("/a", 9, false), ("/imu", 5, true), ("/old", 0, true)]), None).unwrap();
        assert_eq!(one, 1);
        assert!(note.unwrap().contains("/imu"));
    }

    #[test]
    fn doubt_lists_what_is_there() {
        let two = topics(&[("/a", 9, false), ("/b", 5, true), ("/c", 5, true)]);
        let text = choose("f", &two, None).unwrap_err().to_string();
        assert!(text.contains("/b (T, 5 messages), /c") && !text.contains("/a"), "{text}");
        let text = choose("f", &two[..1], None).unwrap_err().to_string();
        assert!(text.contains("no topic holds a gyro; there are /a"), "{text}");
        let text = choose("f", &two, Some("/imu")).unwrap_err().to_string();
        assert!(text.contains("/a (T, 9 messages), /b"), "{text}");
        assert!(choose("f", &[], None).unwrap_err().to_string().contains("there are none"));
    }

    #[test]
    fn names_need_no_slash_and_no_only_instance() {
        let all = topics(&[("/imu/data", 5, true), ("sensor_gyro/0", 5, true), ("IMU/0", 1, true), ("IMU/1", 1, true)]);
        let pick = |name: &str| choose("f", &all, Some(name)).map(|c| c.0).ok();
        assert_eq!(pick("imu/data"), Some(0));
        assert_eq!(pick("sensor_gyro"), Some(1));
        assert_eq!(pick("sensor_gyro/1"), None);
        assert_eq!(pick("imu/1"), Some(3));
        // which of two instances is not guessed, and a namespace is no instance
        assert_eq!(pick("IMU"), None);
        assert_eq!(pick("imu/x"), None);
    }

    #[test]
    fn rates_count_intervals() {
        let mut count = Count::default();
        (0..5).for_each(|i| count.add(1_700_000_000_000_000_000 + i * 250_000_000));
        assert_eq!((count.messages, count.rate_hz()), (5, Some(4.0)));
    }
}
