//! Text files as they are on people's disks.

use std::borrow::Cow;

/// What a file compressed with gzip begins with.
pub(crate) const GZIP: [u8; 2] = [0x1f, 0x8b];

/// Why bytes are no text, and what to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NoText {
    /// A compressed file, under whatever name.
    #[error("is compressed with gzip; unpack it (gunzip)")]
    Gzip,
    /// Another encoding, or no text at all.
    #[error("is not text in UTF-8; save it as UTF-8")]
    NotUtf8,
}

/// The text in the bytes of a file, without the byte-order mark that some editors write before it.
///
/// # Errors
/// They are no text.
pub fn text(bytes: &[u8]) -> Result<&str, NoText> {
    if bytes.starts_with(&GZIP) {
        return Err(NoText::Gzip);
    }
    std::str::from_utf8(bytes).map(without_mark).map_err(|_| NoText::NotUtf8)
}

/// The same for files whose remarks may be in any encoding: what is not UTF-8 is replaced.
///
/// # Errors
/// They are compressed.
pub fn loose_text(bytes: &[u8]) -> Result<Cow<'_, str>, NoText> {
    match text(bytes) {
        Err(NoText::NotUtf8) => Ok(String::from_utf8_lossy(bytes)),
        found => found.map(Cow::Borrowed),
    }
}

/// A text without its byte-order mark.
pub fn without_mark(text: &str) -> &str {
    text.strip_prefix('\u{feff}').unwrap_or(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_read_over_and_what_is_no_text_is_told() {
        assert_eq!(text("\u{feff}name = 1".as_bytes()), Ok("name = 1"));
        assert_eq!(text("Büro 地図".as_bytes()), Ok("Büro 地図"));
        assert_eq!(text(&[0x1f, 0x8b, 8, 0]), Err(NoText::Gzip));
        // UTF-16, as Windows calls "Unicode"
        assert_eq!(text(&[0xff, 0xfe, b'n', 0]), Err(NoText::NotUtf8));
        assert_eq!(loose_text(b"# B\xfcro\n1 2 3 4").unwrap(), "# B\u{fffd}ro\n1 2 3 4");
        assert_eq!(loose_text(&[0x1f, 0x8b]), Err(NoText::Gzip));
    }
}
