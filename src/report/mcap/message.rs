//! Messages, whatever their encoding.

use std::io;

/// A message of a recording: its type with a schema, and its bytes.
pub(crate) trait Message {
    /// Encodings of messages and of schemas (mcap.dev/spec/registry).
    const ENCODINGS: [&'static str; 2];

    /// Full name of the type.
    fn kind() -> String;

    /// Its schema.
    fn schema() -> Vec<u8>;

    /// Appends the message's bytes.
    fn encode(&self, to: &mut Vec<u8>) -> io::Result<()>;
}
