use std::path::PathBuf;

use mcap::{MessageStream, WriteOptions};

use super::*;

/// Messages of a recording with an even spread of topics, in chunks of a few messages each.
const MESSAGES: u32 = 600;
const CHUNK: u64 = 4 << 10;

/// A generator of numbers, the same on every machine (SplitMix64).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, end: usize) -> usize {
        (self.next() % end as u64) as usize
    }
}

/// A whole recording, one message every 0.1 s.
fn recording(compression: Option<mcap::Compression>) -> Vec<u8> {
    let mut numbers = Numbers(7);
    let mut file = std::io::Cursor::new(Vec::new());
    let options = WriteOptions::new().compression(compression).chunk_size(Some(CHUNK));
    let mut writer = options.create(&mut file).unwrap();
    let schema = writer.add_schema("curionav.scan.v1", "cddl", b"scan = [* float]").unwrap();
    let topics = ["robot/r1/scan", "robot/r1/odom", "robot/r2/scan"];
    let ids: Vec<u16> =
        topics.map(|t| writer.add_channel(schema, t, "cbor", &BTreeMap::new()).unwrap()).to_vec();
    for sequence in 0..MESSAGES {
        let data: Vec<u8> = (0..200).map(|_| numbers.below(40) as u8).collect();
        let time = u64::from(sequence) * 100_000_000;
        let channel_id = ids[sequence as usize % ids.len()];
        let header = MessageHeader { channel_id, sequence, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, &data).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    file.into_inner()
}

fn whole() -> Vec<u8> {
    recording(Some(mcap::Compression::Lz4))
}

/// What comes of these bytes, and the messages of the new file.
fn recovered(bytes: &[u8]) -> (Recovery, Vec<(u32, Vec<u8>)>) {
    let folder = tempfile::tempdir().unwrap();
    let damaged = folder.path().join("damaged.mcap");
    let new = folder.path().join("whole.mcap");
    std::fs::write(&damaged, bytes).unwrap();
    let recovery = recover(&damaged, &new).unwrap();
    let copied = std::fs::read(&new).unwrap();
    let messages: Vec<_> = MessageStream::new(&copied)
        .unwrap()
        .map(Result::unwrap)
        .map(|message| (message.sequence, message.data.into_owned()))
        .collect();
    assert_eq!(messages.len() as u64, recovery.messages);
    assert!(mcap::Summary::read(&copied).unwrap().is_some());
    (recovery, messages)
}

/// Where each chunk of a whole recording is.
fn chunks(bytes: &[u8]) -> Vec<Range<usize>> {
    Found::search(bytes).chunks().cloned().collect()
}

#[test]
fn a_whole_recording_loses_nothing() {
    for compression in [None, Some(mcap::Compression::Lz4)] {
        let (recovery, messages) = recovered(&recording(compression));
        assert_eq!((messages.len(), recovery.is_loss()), (MESSAGES as usize, false));
        assert_eq!(recovery.to_string(), "600 messages");
        assert!(messages.iter().enumerate().all(|(i, (sequence, _))| i == *sequence as usize));
    }
}

#[test]
fn a_bad_chunk_is_skipped_and_what_it_held_is_told() {
    let bytes = whole();
    let chunks = chunks(&bytes);
    assert!(chunks.len() > 20);
    for index in [0, 5, chunks.len() - 1] {
        let mut damaged = bytes.clone();
        let chunk = &chunks[index];
        damaged[chunk.start + chunk.len() / 2] ^= 0x55;
        let (recovery, messages) = recovered(&damaged);
        assert!(recovery.is_loss());
        assert_eq!(recovery.damages.len(), 1);
        assert_eq!(recovery.damages[0].bytes.start, chunk.start);
        let lost = MESSAGES as usize - messages.len();
        assert!((1..100).contains(&lost), "{lost} of chunk {index}");
        let said = recovery.to_string();
        assert!(said.contains(&format!("; {lost} of 600 are lost; bytes {} to", chunk.start)), "{said}");
    }
}

/// Each field of a chunk's record in turn is wrong: the rest of the file is still read.
#[test]
fn no_field_of_a_chunk_is_believed() {
    let bytes = whole();
    let chunk = chunks(&bytes)[3].clone();
    // Opcode, length, times, sizes, checksum, compression, compressed size.
    for offset in (0..PREFIX + 32 + 3 + 8).filter(|offset| !(PREFIX..PREFIX + 16).contains(offset)) {
        for value in [0x00, 0x01, 0x7f, 0xff] {
            let mut damaged = bytes.clone();
            if damaged[chunk.start + offset] == value {
                continue;
            }
            damaged[chunk.start + offset] = value;
            let (recovery, messages) = recovered(&damaged);
            assert!(recovery.is_loss(), "offset {offset}: {recovery}");
            assert!(messages.len() > 550, "offset {offset}, value {value}: {recovery}");
        }
    }
}

/// Forty files, and then many more, with one, three or ten bytes overwritten, or cut, by a seed.
#[test]
fn whatever_is_flipped_or_cut_the_rest_is_read() {
    let original = whole();
    let (_, all) = recovered(&original);
    for seed in 0..400 {
        let mut numbers = Numbers(seed);
        let mut bytes = original.clone();
        let count = [1, 3, 10, 0][seed as usize % 4];
        for _ in 0..count {
            let at = numbers.below(bytes.len());
            bytes[at] = numbers.next() as u8;
        }
        if count == 0 {
            bytes.truncate(MAGIC.len() + numbers.below(original.len() - MAGIC.len()));
        }
        let (recovery, messages) = recovered(&bytes);
        // Nothing is made up, and nothing is lost without a word.
        let is_true = messages.iter().all(|message| all[message.0 as usize] == *message);
        assert!(is_true, "seed {seed}");
        assert!(messages.len() == all.len() || recovery.is_loss(), "seed {seed}: {recovery}");
        assert!(count == 0 || messages.len() > 400, "seed {seed}: {recovery}");
    }
}

#[test]
fn what_is_no_recording_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let noise: Vec<u8> = (0..10_000_u32).map(|i| (i * i % 251) as u8).collect();
    for (name, bytes) in [("empty", vec![]), ("text", b"a text".to_vec()), ("noise", noise)] {
        let path: PathBuf = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let error = recover(&path, &folder.path().join("new.mcap")).unwrap_err();
        assert_eq!((error.code, error.line().contains("is no MCAP file")), (2, true), "{error}");
        assert!(!folder.path().join("new.mcap").exists());
    }
}

#[test]
fn a_damaged_first_magic_loses_nothing_but_itself() {
    let mut bytes = whole();
    bytes[3] = b'x';
    let (recovery, messages) = recovered(&bytes);
    assert_eq!((messages.len(), recovery.is_loss()), (MESSAGES as usize, false), "{recovery}");
    assert!(recovery.to_string().ends_with("; no message is lost"), "{recovery}");
}
