//! A damaged or unfinished recording made whole: every sound chunk is copied, and what was lost is told.
//!
//! Nothing that the file says about lengths is believed before a chunk's checksum agrees. Where a record makes no
//! sense, the next sound one is searched for byte by byte.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;
use std::path::Path;

use anyhow::{Context, anyhow};
use curionav_runtime::exit::Exit;
use mcap::MAGIC;
use mcap::records::{Channel, MessageHeader, Record, SchemaHeader, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::writer::create;

/// No chunk is larger, as it stands in the file and as it is unpacked: see `read.rs`.
const MAX_CHUNK: usize = 256 << 20;
/// Opcode and length of a record.
const PREFIX: usize = 9;

/// What came of a recovery.
#[derive(Debug, Default, PartialEq)]
pub struct Recovery {
    /// Messages that were copied.
    pub messages: u64,
    /// Places that could not be read, in order.
    pub damages: Vec<Damage>,
    /// Messages that could be read, but whose topic was lost.
    pub nameless: u64,
    /// Messages that the recording once had, if its end still says so.
    pub expected: Option<u64>,
    /// Whether the recording ends as its recorder wrote it.
    pub has_end: bool,
}

/// A place of a file that could not be read.
#[derive(Debug, Clone, PartialEq)]
pub struct Damage {
    /// Bytes of the file.
    pub bytes: Range<usize>,
    /// The last message before it and the first one behind it, seconds after the first message of all.
    pub between: [Option<f64>; 2],
}

impl Recovery {
    /// Messages that are known to be missing; nothing if their number is not known.
    fn missing(&self) -> Option<u64> {
        self.expected.and_then(|expected| expected.checked_sub(self.messages))
    }

    /// Whether the new file may hold less than the recording once did. A damaged index loses nothing.
    pub fn is_loss(&self) -> bool {
        let is_damaged = !self.damages.is_empty() || !self.has_end;
        self.nameless > 0 || is_damaged && self.missing() != Some(0)
    }
}

impl fmt::Display for Recovery {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} messages", self.messages)?;
        if let Some(missing) = self.missing().filter(|missing| *missing > 0) {
            write!(f, "; {missing} of {} are lost", missing + self.messages)?;
        }
        if self.nameless > 0 {
            write!(f, "; {} were left out, because their topics are lost", self.nameless)?;
        }
        for Damage { bytes, between } in &self.damages {
            let from = between[0].map_or("the beginning".into(), |seconds| format!("{seconds:.1} s"));
            let to = between[1].map_or("the end".into(), |seconds| format!("{seconds:.1} s"));
            write!(f, "; bytes {} to {} are damaged (from {from} to {to})", bytes.start, bytes.end)?;
        }
        if !self.has_end {
            f.write_str("; its end is missing")?;
        }
        if !self.is_loss() && !self.damages.is_empty() {
            f.write_str("; no message is lost")?;
        }
        Ok(())
    }
}

/// Makes a damaged or killed recording whole, with an index: copies what is sound in `damaged` into `whole`, which must
/// not exist. The damaged one is read into memory.
///
/// # Errors
/// Bad input if `damaged` cannot be read, holds nothing that is sound, or `whole` cannot be made; failed if the disk
/// does not take all of it.
pub fn recover(damaged: &Path, whole: &Path) -> Result<Recovery, Exit> {
    let bytes = std::fs::read(damaged).with_context(|| format!("cannot read {}", damaged.display()));
    let bytes = bytes.map_err(Exit::bad_input)?;
    let found = Found::search(&bytes);
    if found.chunks().next().is_none() && !bytes.starts_with(MAGIC) {
        let nothing = "is no MCAP file, or nothing in it can be read";
        return Err(Exit::bad_input(anyhow!("{}: {nothing}", damaged.display())));
    }
    found.copy(&bytes, whole)
}

/// A part of a file.
enum Part {
    /// A record with a sound chunk.
    Chunk(Range<usize>),
    Damage(Range<usize>),
}

/// What is in a file.
#[derive(Default)]
struct Found {
    parts: Vec<Part>,
    schemas: BTreeMap<u16, (SchemaHeader, Vec<u8>)>,
    channels: BTreeMap<u16, Channel>,
    expected: Option<u64>,
    has_end: bool,
}

impl Found {
    fn search(bytes: &[u8]) -> Self {
        let mut found = Self::default();
        let mut at = 0;
        if bytes.starts_with(MAGIC) {
            at = MAGIC.len();
        }
        let mut of_summary = Self::default();
        while at < bytes.len() {
            if bytes[at..] == *MAGIC {
                found.has_end = true;
                break;
            }
            match sound_record(bytes, at) {
                Some(Sound::Chunk { end, records }) => {
                    records.iter().for_each(|(opcode, data)| found.learn(*opcode, data));
                    found.parts.push(Part::Chunk(at..end));
                    at = end;
                }
                Some(Sound::Other { end }) => {
                    // These have no checksum of their own: what a chunk says counts more.
                    of_summary.learn(bytes[at], &bytes[at + PREFIX..end]);
                    at = end;
                }
                None => {
                    let next = (at + 1..bytes.len()).find(|&next| is_restart(bytes, next));
                    let end = next.unwrap_or(bytes.len());
                    found.parts.push(Part::Damage(at..end));
                    at = end;
                }
            }
        }
        for (id, schema) in of_summary.schemas {
            found.schemas.entry(id).or_insert(schema);
        }
        for (id, channel) in of_summary.channels {
            found.channels.entry(id).or_insert(channel);
        }
        found.expected = of_summary.expected;
        found
    }

    fn chunks(&self) -> impl Iterator<Item = &Range<usize>> {
        self.parts.iter().filter_map(|part| match part {
            Part::Chunk(range) => Some(range),
            Part::Damage(_) => None,
        })
    }

    /// Keeps what a record says of topics and of the number of messages.
    fn learn(&mut self, opcode: u8, data: &[u8]) {
        if !matches!(opcode, op::SCHEMA | op::CHANNEL | op::STATISTICS) {
            return;
        }
        match mcap::parse_record(opcode, data) {
            Ok(Record::Schema { header, data }) => {
                self.schemas.entry(header.id).or_insert((header, data.into_owned()));
            }
            Ok(Record::Channel(channel)) => {
                self.channels.entry(channel.id).or_insert(channel);
            }
            Ok(Record::Statistics(statistics)) => self.expected = Some(statistics.message_count),
            _ => {}
        }
    }

    fn copy(&self, bytes: &[u8], whole: &Path) -> Result<Recovery, Exit> {
        let mut writer = create(whole).map_err(Exit::bad_input)?;
        let failed = |error: mcap::McapError| {
            Exit::failed(anyhow::Error::from(error).context(format!("cannot write {}", whole.display())))
        };
        let mut recovery = Recovery { expected: self.expected, has_end: self.has_end, ..Recovery::default() };
        let mut ids = BTreeMap::<u16, u16>::new();
        let mut times = Times::default();
        // Damages behind which no message has come yet.
        let mut open = 0;
        for part in &self.parts {
            let range = match part {
                Part::Damage(range) => {
                    let between = [times.seconds(times.last), None];
                    recovery.damages.push(Damage { bytes: range.clone(), between });
                    continue;
                }
                Part::Chunk(range) => range.clone(),
            };
            for (header, data) in messages(&bytes[range]) {
                times.note(header.log_time);
                for damage in &mut recovery.damages[open..] {
                    damage.between[1] = times.seconds(times.last);
                }
                open = recovery.damages.len();
                let Some(id) = self.topic(&mut writer, &mut ids, header.channel_id).map_err(failed)? else {
                    recovery.nameless += 1;
                    continue;
                };
                let header = MessageHeader { channel_id: id, ..header };
                writer.write_to_known_channel(&header, &data).map_err(failed)?;
                recovery.messages += 1;
            }
        }
        writer.finish().map_err(failed)?;
        Ok(recovery)
    }

    /// The new number of a topic, which is made when its first message comes; nothing if the topic is lost.
    fn topic(
        &self,
        writer: &mut super::writer::Mcap,
        ids: &mut BTreeMap<u16, u16>,
        old: u16,
    ) -> mcap::McapResult<Option<u16>> {
        if let Some(new) = ids.get(&old) {
            return Ok(Some(*new));
        }
        let Some(channel) = self.channels.get(&old) else { return Ok(None) };
        let schema = match self.schemas.get(&channel.schema_id) {
            Some((schema, data)) => writer.add_schema(&schema.name, &schema.encoding, data)?,
            // A channel without a schema has number 0; of another the schema is lost.
            None if channel.schema_id == 0 => 0,
            None => return Ok(None),
        };
        let new = writer.add_channel(schema, &channel.topic, &channel.message_encoding, &channel.metadata)?;
        ids.insert(old, new);
        Ok(Some(new))
    }
}

/// When messages were recorded, nanoseconds.
#[derive(Default)]
struct Times {
    first: Option<u64>,
    last: Option<u64>,
}

impl Times {
    fn note(&mut self, time: u64) {
        self.first = self.first.or(Some(time));
        self.last = Some(time);
    }

    fn seconds(&self, time: Option<u64>) -> Option<f64> {
        Some((time? as f64 - self.first? as f64) / 1e9)
    }
}

/// A record that makes sense, and where it ends.
enum Sound {
    Chunk { end: usize, records: Vec<(u8, Vec<u8>)> },
    Other { end: usize },
}

fn sound_record(bytes: &[u8], at: usize) -> Option<Sound> {
    let end = framed(bytes, at)?;
    if bytes[at] == op::CHUNK {
        return Some(Sound::Chunk { end, records: unpacked(&bytes[at..end])? });
    }
    is_sound(bytes[at], &bytes[at + PREFIX..end]).then_some(Sound::Other { end })
}

/// Where the record at `at` ends, if there can be one.
fn framed(bytes: &[u8], at: usize) -> Option<usize> {
    let prefix = bytes.get(at..at + PREFIX)?;
    let length = usize::try_from(u64::from_le_bytes(prefix[1..].try_into().ok()?)).ok()?;
    let end = (at + PREFIX).checked_add(length)?;
    let can_be = (op::HEADER..=op::DATA_END).contains(&prefix[0]) && end <= bytes.len();
    can_be.then_some(end)
}

/// Whether a record that is no chunk is what it says. Attachments are none of a recorder's records.
fn is_sound(opcode: u8, data: &[u8]) -> bool {
    match opcode {
        op::MESSAGE | op::ATTACHMENT => false,
        // It has a list whose length in bytes stands before it, and nothing behind it.
        op::MESSAGE_INDEX => {
            let length = data.get(2..6).and_then(|length| length.try_into().ok()).map(u32::from_le_bytes);
            length.is_some_and(|length| length as usize + 6 == data.len())
        }
        _ => mcap::parse_record(opcode, data).is_ok(),
    }
}

/// Whether reading can go on here: at a sound chunk, at the end, or at two sound records in a row.
fn is_restart(bytes: &[u8], at: usize) -> bool {
    if bytes[at..] == *MAGIC {
        return true;
    }
    match sound_record(bytes, at) {
        Some(Sound::Chunk { .. }) => true,
        Some(Sound::Other { end }) => bytes[end..] == *MAGIC || sound_record(bytes, end).is_some(),
        None => false,
    }
}

/// The records of a chunk, if its checksum agrees with all of them.
fn unpacked(chunk: &[u8]) -> Option<Vec<(u8, Vec<u8>)>> {
    if !is_chunk(&chunk[PREFIX..]) {
        return None;
    }
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_validate_chunk_crcs(true)
        .with_prevalidate_chunk_crcs(true)
        .with_record_length_limit(MAX_CHUNK);
    let mut reader = LinearReader::new_with_options(options);
    let mut rest = chunk;
    let mut records = Vec::new();
    while let Some(event) = reader.next_event() {
        match event {
            Ok(LinearReadEvent::ReadRequest(need)) => {
                let (now, later) = rest.split_at(need.min(rest.len()));
                if now.is_empty() {
                    break;
                }
                reader.insert(now.len()).copy_from_slice(now);
                reader.notify_read(now.len());
                rest = later;
            }
            Ok(LinearReadEvent::Record { opcode, data }) => records.push((opcode, data.to_vec())),
            Err(_) => return None,
        }
    }
    rest.is_empty().then_some(records)
}

/// Whether the sizes in a chunk's header agree with each other and with its length.
fn is_chunk(data: &[u8]) -> bool {
    let Ok(Record::Chunk { header, .. }) = mcap::parse_record(op::CHUNK, data) else { return false };
    let is_small = header.uncompressed_size <= MAX_CHUNK as u64;
    let is_known = matches!(header.compression.as_str(), "" | "lz4");
    // Three numbers of 64 bits, one of 32, and a text behind its length of 32 bits, and the number of what follows.
    let before = 8 + 8 + 8 + 4 + 4 + header.compression.len() as u64 + 8;
    is_small && is_known && header.compressed_size.checked_add(before) == Some(data.len() as u64)
}

/// The messages of a sound chunk.
fn messages(chunk: &[u8]) -> impl Iterator<Item = (MessageHeader, Vec<u8>)> {
    let records = unpacked(chunk).unwrap_or_default();
    let of_messages = records.into_iter().filter(|(opcode, _)| *opcode == op::MESSAGE);
    of_messages.filter_map(|(opcode, data)| match mcap::parse_record(opcode, &data) {
        Ok(Record::Message { header, data }) => Some((header, data.into_owned())),
        _ => None,
    })
}

#[cfg(test)]
#[path = "recover_tests.rs"]
mod tests;
