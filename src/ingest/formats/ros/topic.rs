//! The messages of one topic as a table, whatever file holds them.

use super::{Message, RowError, Rows};
use crate::error::{Error, ErrorKind, Result};
use crate::ingest::formats::head::Head;
use crate::ingest::formats::source::{Facts, Source, Take};
use crate::ingest::formats::topics::{Container, Stamp};

/// Where a message lies.
#[derive(Debug, Clone, Copy)]
pub(in crate::ingest) enum Place {
    /// Byte of its record, or of the chunk that holds it.
    Byte(u64),
    /// Its number in the table of messages.
    #[cfg(feature = "db3")]
    Id(i64),
}

/// Takes a message's bytes, its time of receipt (ns), and where it lies.
pub(in crate::ingest) type MeetMessage<'a> = &'a mut dyn FnMut(&[u8], i64, Place) -> Result<()>;

/// A file with messages of ROS.
pub(in crate::ingest) trait MessageFile: Container {
    /// Identifier of the publishers of a topic.
    type Id;
    /// Remedy for a message that is damaged.
    const MEND: &'static str;
    /// Hands every message of `topic`, whose publishers are `own`, to `meet` in the file's order. Says what was lost.
    fn walk(&self, own: &[Self::Id], topic: &str, meet: MeetMessage<'_>) -> Result<Option<String>>;
}

/// One topic of a file.
pub(in crate::ingest) struct OneTopic<F: MessageFile> {
    file: F,
    own: Vec<F::Id>,
    message: Message,
    heads: Vec<Head>,
    stamp: Stamp,
    topic: String,
}

impl<F: MessageFile> OneTopic<F> {
    /// The messages of type `message` on `topic`, whose publishers are `own`.
    pub(crate) fn new(file: F, own: Vec<F::Id>, message: Message, stamp: Stamp, topic: String) -> Self {
        let heads = message.heads(stamp);
        Self { file, own, message, heads, stamp, topic }
    }
}

impl<F: MessageFile> Source for OneTopic<F> {
    fn heads(&self) -> &[Head] {
        &self.heads
    }

    fn rows(&self) -> Option<u64> {
        self.file.listing().messages(&self.topic)
    }

    fn read(self: Box<Self>, wanted: &[bool], take: Take<'_>) -> Result<Facts> {
        let Self { file, own, message, stamp, topic, .. } = *self;
        let about = file.listing().about.clone();
        let mut rows = Rows::new(&message, wanted, stamp);
        let lost = file.walk(&own, &topic, &mut |data, receipt_ns, place| {
            rows.add(data, receipt_ns, take).map_err(|e| match e {
                RowError::Taken(e) => e,
                RowError::Message(why) => {
                    let at = match place {
                        Place::Byte(at) => format!("message {} of {topic}, in the record at byte {at}", rows.count()),
                        #[cfg(feature = "db3")]
                        Place::Id(id) => format!("table messages, id {id}"),
                    };
                    Error::new(ErrorKind::Format, &about.source, why).at(at).hint(F::MEND)
                }
            })
        })?;
        let read = rows.count();
        let (columns, mut notes) = rows.finish(take)?;
        notes.extend(lost.map(|lost| format!("{lost}; {read} messages of {topic} are read")));
        Ok(about.facts(Some(&topic), columns, notes))
    }
}
