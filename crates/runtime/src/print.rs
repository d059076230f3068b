//! Standard output, and what people are told on standard error.

use std::fmt::Display;
use std::io::{ErrorKind, Write};

use crate::exit::Exit;

/// Prints `text` and a line break. A reader that has ended (`curionav ... | head -1`) is no failure: it does not want
/// the rest.
///
/// # Errors
/// Failed, if standard output cannot be written for another reason.
pub fn print(text: impl Display) -> Result<(), Exit> {
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{text}").and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Exit::failed(anyhow::Error::from(error).context("cannot write to standard output")))
        }
        _ => Ok(()),
    }
}

/// Prints `text` and a line break on standard error. `eprintln!` would panic on a full disk or a closed pipe; here the
/// line is lost instead.
pub fn note(text: impl Display) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}
