//! Reading a recording back, message by message: what is needed to plan its cycles again, or to localise again.
//!
//! A recording whose program was killed ends without an index and perhaps within a chunk; everything up to there is
//! read.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use curionav_schemas::{
    Belief, CycleReport, Memory, Message, Mission, OccupancyGrid, Odometry, RunStatus, Scan, ServiceStatus,
};
use mcap::McapError;
use mcap::records::{Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::MESSAGE_ENCODING;
use super::recorder::names;

/// No record is larger: a chunk of 1 MiB and one message of 25 MiB, with room for other programs' chunks.
const MAX_RECORD: usize = 256 << 20;
const BLOCK: usize = 1 << 20;

/// What a reader is given, in the order in which it was recorded.
#[derive(Debug)]
pub enum Item {
    /// What a robot is to do, or how that stands.
    Mission(Box<Mission>),
    /// A map that a mission names.
    Map(OccupancyGrid),
    /// What a service says of itself.
    Status(Box<ServiceStatus>),
    /// What a planning cycle began with.
    Memory(Box<Memory>),
    /// What a planning cycle came to.
    Report(Box<CycleReport>),
    /// What the scanner of the robot of that name saw. Scans of further sensors are passed over.
    Scan(String, Box<Scan>),
    /// How far that robot has driven.
    Odometry(String, Odometry),
    /// Where it believed it was.
    Belief(String, Box<Belief>),
    /// How a simulated run stands.
    Run(Box<RunStatus>),
}

/// A recording being read.
pub struct Reader {
    path: PathBuf,
    file: File,
    mcap: LinearReader,
    /// Schema names by id.
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, Channel>,
    /// Whether the recording ended in the middle, as one whose program was killed does. Known at its end.
    pub cut_short: bool,
}

struct Channel {
    schema: String,
    encoding: String,
    /// The robot or world whose messages these are.
    owner: String,
    /// The rest of their key, such as `scan` or `scan/camera`.
    stream: String,
}

impl Reader {
    /// Opens the recording in the file `path`.
    pub fn open(path: &Path) -> anyhow::Result<Self> {
        let file = File::open(path).with_context(|| format!("cannot read {}", path.display()))?;
        let options = LinearReaderOptions::default()
            .with_skip_end_magic(true)
            .with_validate_chunk_crcs(true)
            .with_record_length_limit(MAX_RECORD);
        let mcap = LinearReader::new_with_options(options);
        let path = path.to_owned();
        Ok(Self { path, file, mcap, schemas: BTreeMap::new(), channels: BTreeMap::new(), cut_short: false })
    }

    /// The next message of interest; none at the end.
    ///
    /// # Errors
    /// Naming the file, if it is no MCAP file or a message in it is not understood.
    pub fn next_message(&mut self) -> anyhow::Result<Option<Item>> {
        let path = self.path.display().to_string();
        self.next_item().with_context(|| path)
    }

    fn next_item(&mut self) -> anyhow::Result<Option<Item>> {
        while let Some(event) = self.mcap.next_event() {
            match event {
                Ok(LinearReadEvent::ReadRequest(need)) => {
                    let read = self.file.read(self.mcap.insert(need.max(BLOCK)))?;
                    self.mcap.notify_read(read);
                }
                Ok(LinearReadEvent::Record { opcode: op::DATA_END, .. }) => return Ok(None),
                Ok(LinearReadEvent::Record { opcode, data }) => match mcap::parse_record(opcode, data)? {
                    Record::Schema { header, .. } => {
                        self.schemas.insert(header.id, header.name);
                    }
                    Record::Channel(channel) => {
                        let schema = self.schemas.get(&channel.schema_id).cloned().unwrap_or_default();
                        let (owner, stream) = names(&channel.topic);
                        let owner = owner.to_owned();
                        let stream = stream.to_owned();
                        let encoding = channel.message_encoding;
                        self.channels.insert(channel.id, Channel { schema, encoding, owner, stream });
                    }
                    Record::Message { header, data } => {
                        let channel = self.channels.get(&header.channel_id);
                        if let Some(channel) = channel.filter(|channel| channel.encoding == MESSAGE_ENCODING)
                            && let Some(item) = item(channel, &data)?
                        {
                            return Ok(Some(item));
                        }
                    }
                    _ => {}
                },
                Err(McapError::UnexpectedEof | McapError::UnexpectedEoc) => {
                    self.cut_short = true;
                    return Ok(None);
                }
                Err(McapError::BadMagic) => bail!("not an MCAP file"),
                Err(error) => return Err(error.into()),
            }
        }
        self.cut_short = true;
        Ok(None)
    }
}

fn item(channel: &Channel, data: &[u8]) -> anyhow::Result<Option<Item>> {
    let Channel { schema, owner, stream, .. } = channel;
    let Some((name, _)) = schema.strip_prefix("curionav.").and_then(|rest| rest.rsplit_once('.')) else {
        return Ok(None);
    };
    // The version is judged where messages are decoded.
    let encoding = format!("application/cbor;{schema}");
    Ok(Some(match name {
        Mission::NAME => Item::Mission(Box::new(Mission::decode(data, Some(&encoding))?)),
        OccupancyGrid::NAME => Item::Map(OccupancyGrid::decode(data, Some(&encoding))?),
        ServiceStatus::NAME => Item::Status(Box::new(ServiceStatus::decode(data, Some(&encoding))?)),
        Memory::NAME => Item::Memory(Box::new(Memory::decode(data, Some(&encoding))?)),
        CycleReport::NAME => Item::Report(Box::new(CycleReport::decode(data, Some(&encoding))?)),
        Scan::NAME if stream == "scan" => {
            Item::Scan(owner.clone(), Box::new(Scan::decode(data, Some(&encoding))?))
        }
        Odometry::NAME => Item::Odometry(owner.clone(), Odometry::decode(data, Some(&encoding))?),
        Belief::NAME => Item::Belief(owner.clone(), Box::new(Belief::decode(data, Some(&encoding))?)),
        RunStatus::NAME => Item::Run(Box::new(RunStatus::decode(data, Some(&encoding))?)),
        _ => return Ok(None),
    }))
}
