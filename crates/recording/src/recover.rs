//! A killed recording made whole: the same messages with an index, for viewers that want one.

use std::path::Path;

use anyhow::Context;
use mcap::MessageStream;
use mcap::read::Options;

use super::writer::create;

/// Copies what is left of `killed` into `whole`, which must not exist; how many messages that is. The killed one is
/// read into memory.
pub fn recover(killed: &Path, whole: &Path) -> anyhow::Result<u64> {
    let bytes = std::fs::read(killed).with_context(|| format!("cannot read {}", killed.display()))?;
    let stream = MessageStream::new_with_options(&bytes, Options::IgnoreEndMagic.into())
        .with_context(|| killed.display().to_string())?;
    let mut writer = create(whole)?;
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
