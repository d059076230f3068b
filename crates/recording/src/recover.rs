//! A killed recording made whole: the same messages with an index, for viewers that want one.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use anyhow::Context;
use mcap::read::Options;
use mcap::{Compression, MessageStream, WriteOptions};

/// Copies what is left of `killed` into `whole`, which must not exist; how many messages that is. The killed one is
/// read into memory.
pub fn recover(killed: &Path, whole: &Path) -> anyhow::Result<u64> {
    let bytes = std::fs::read(killed).with_context(|| format!("cannot read {}", killed.display()))?;
    let stream = MessageStream::new_with_options(&bytes, Options::IgnoreEndMagic.into())
        .with_context(|| killed.display().to_string())?;
    let file = File::create_new(whole).with_context(|| format!("cannot create {}", whole.display()))?;
    let options = WriteOptions::new()
        .library(concat!("curionav ", env!("CARGO_PKG_VERSION")))
        .compression(Some(Compression::Lz4));
    let mut writer = options.create(BufWriter::new(file))?;
    let mut messages = 0;
    for message in stream {
        // The first that cannot be read is where it was killed.
        let Ok(message) = message else { break };
        writer.write(&message).with_context(|| format!("cannot write {}", whole.display()))?;
        messages += 1;
    }
    writer.finish()?;
    Ok(messages)
}
