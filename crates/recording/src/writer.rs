//! An MCAP file being written: complete chunks are on disk within a second, so that a killed recording loses no more.

use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::Context;
use curionav_schemas::CDDL;
use foxglove::Encode;
use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions, Writer};

use super::MESSAGE_ENCODING;

/// Bytes of messages in a chunk: readers load whole chunks.
const CHUNK: u64 = 1 << 20;
/// Longest a message waits for its chunk to be full.
const FLUSH_PERIOD: Duration = Duration::from_secs(1);

/// A file that is written in chunks.
pub(super) type Mcap = Writer<BufWriter<File>>;

pub(super) struct RecordingWriter {
    file: Mcap,
    /// By topic: identifier, and number of the next message.
    channels: HashMap<String, (u16, u32)>,
    flushed: Instant,
    pub(super) messages: u64,
}

/// A file where there is none yet, to be written in chunks.
pub(super) fn create(path: &Path) -> anyhow::Result<Mcap> {
    let file = File::create_new(path).with_context(|| format!("cannot create {}", path.display()))?;
    let options = WriteOptions::new()
        .library(concat!("curionav ", env!("CARGO_PKG_VERSION")))
        .compression(Some(Compression::Lz4))
        .chunk_size(Some(CHUNK));
    Ok(options.create(BufWriter::new(file))?)
}

impl RecordingWriter {
    pub(super) fn create(path: &Path) -> anyhow::Result<Self> {
        let mut file = create(path)?;
        // From here on it is an MCAP file, whatever happens.
        file.flush()?;
        Ok(Self { file, channels: HashMap::new(), flushed: Instant::now(), messages: 0 })
    }

    /// A message of the contract, as it was sent. Times are nanoseconds.
    pub(super) fn contract(
        &mut self,
        topic: &str,
        encoding: &str,
        bytes: &[u8],
        time: u64,
    ) -> anyhow::Result<()> {
        if !self.channels.contains_key(topic) {
            // Such as `application/cbor;curionav.scan.v1`. The first rule of a CDDL text is what it describes.
            let (_, schema) = encoding.split_once(';').context("an encoding without a schema")?;
            let rules = format!("curionav = {}\n{CDDL}", schema.split('.').nth(1).unwrap_or_default());
            self.open(topic, schema, "cddl", rules.as_bytes(), MESSAGE_ENCODING)?;
        }
        self.write(topic, bytes, time)
    }

    pub(super) fn picture<M: Encode>(&mut self, topic: &str, message: &M, time: u64) -> anyhow::Result<()> {
        if !self.channels.contains_key(topic) {
            let schema = M::get_schema().context("a message without a schema")?;
            self.open(topic, &schema.name, &schema.encoding, &schema.data, &M::get_message_encoding())?;
        }
        let mut bytes = Vec::with_capacity(message.encoded_len().unwrap_or_default());
        message.encode(&mut bytes).map_err(|e| anyhow::anyhow!("{topic}: {e}"))?;
        self.write(topic, &bytes, time)
    }

    fn open(
        &mut self,
        topic: &str,
        schema: &str,
        schema_encoding: &str,
        data: &[u8],
        encoding: &str,
    ) -> anyhow::Result<()> {
        let schema = self.file.add_schema(schema, schema_encoding, data)?;
        let id = self.file.add_channel(schema, topic, encoding, &BTreeMap::new())?;
        self.channels.insert(topic.to_owned(), (id, 0));
        Ok(())
    }

    fn write(&mut self, topic: &str, bytes: &[u8], time: u64) -> anyhow::Result<()> {
        let Some((id, next)) = self.channels.get_mut(topic) else { return Ok(()) };
        let header = MessageHeader { channel_id: *id, sequence: *next, log_time: time, publish_time: time };
        *next = next.wrapping_add(1);
        self.messages += 1;
        self.file.write_to_known_channel(&header, bytes)?;
        Ok(())
    }

    /// Puts on disk what has waited long enough.
    pub(super) fn flush_if_due(&mut self) -> anyhow::Result<()> {
        if self.flushed.elapsed() >= FLUSH_PERIOD {
            self.flushed = Instant::now();
            self.file.flush()?;
        }
        Ok(())
    }

    pub(super) fn finish(mut self) -> anyhow::Result<()> {
        self.file.finish()?;
        let file = self.file.into_inner().into_inner().map_err(|e| e.into_error())?;
        file.sync_all()?;
        Ok(())
    }
}
