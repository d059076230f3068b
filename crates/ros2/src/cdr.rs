//! Common Data Representation, version 1, as ROS 2 uses it: OMG DDSI-RTPS 2.5, 9.3, and DDS-XTypes 1.3, 7.4.1.
//!
//! Numbers are aligned to their size, counted from the end of the four bytes of encapsulation. A text has its length
//! with its NUL before it, a sequence its number of items. Both byte orders are read, little-endian is written.

use crate::limits;

/// Bytes of encapsulation before the content.
const ENCAPSULATION: usize = 4;
/// Bytes that may follow the content: DDS fills up to a multiple of four.
const PADDING_MAX: usize = 3;

/// Why bytes are not the message they should be, or a value cannot be written as one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{field}: {fault}")]
pub struct CdrError {
    /// The innermost field that has a name; `message` for the whole.
    pub field: &'static str,
    /// What is wrong with it.
    pub fault: CdrFault,
}

/// What is wrong with a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum CdrFault {
    /// It is neither plain CDR nor of a known byte order.
    #[error("has the encapsulation {0:#06x}; 0x0000 and 0x0001 are plain CDR")]
    Encapsulation(u16),
    /// The bytes end before it does.
    #[error("is cut short")]
    Short,
    /// It is longer than it may be.
    #[error("has a length of {found}; the most is {most}")]
    TooLong {
        /// Its length: bytes of a text or message, items of a sequence.
        found: usize,
        /// The greatest that is allowed.
        most: usize,
    },
    /// Its text is not UTF-8, does not end with its NUL, or has one before.
    #[error("is not text")]
    Text,
    /// It is neither 0 nor 1.
    #[error("is {0}; a truth value is 0 or 1")]
    Bool(u8),
    /// More bytes follow it than alignment explains.
    #[error("is followed by {0} bytes")]
    Trailing(usize),
}

impl CdrFault {
    /// The error of the field with this name.
    pub(crate) fn at(self, field: &'static str) -> CdrError {
        CdrError { field, fault: self }
    }
}

/// Something that CDR can hold.
pub trait Cdr: Sized {
    /// Bytes that it takes at least, alignment apart: no sequence can have more items than its bytes allow.
    const MIN_BYTES: usize;

    /// Writes it.
    ///
    /// # Errors
    /// If something in it is longer than a reader would take.
    fn write(&self, out: &mut Writer) -> Result<(), CdrFault>;

    /// Reads one.
    ///
    /// # Errors
    /// If the bytes are none.
    fn read(input: &mut Reader<'_>) -> Result<Self, CdrError>;

    /// Writes several in a row.
    ///
    /// # Errors
    /// If one of them cannot be written.
    fn write_all(items: &[Self], out: &mut Writer) -> Result<(), CdrFault> {
        items.iter().try_for_each(|item| item.write(out))
    }

    /// Reads `count` in a row; the caller has compared `count` with its limit and with the bytes that are there.
    ///
    /// # Errors
    /// If the bytes are none.
    fn read_all(input: &mut Reader<'_>, count: usize) -> Result<Vec<Self>, CdrError> {
        let mut items = Vec::with_capacity(count);
        for _ in 0..count {
            items.push(Self::read(input)?);
        }
        Ok(items)
    }
}

/// Writes the content of one message.
#[derive(Debug, Default)]
pub struct Writer {
    content: Vec<u8>,
}

impl Writer {
    fn align(&mut self, size: usize) {
        self.content.resize(self.content.len().next_multiple_of(size), 0);
    }

    fn length(&mut self, found: usize, most: usize) -> Result<(), CdrFault> {
        match u32::try_from(found) {
            Ok(length) if found <= most => length.write(self),
            _ => Err(CdrFault::TooLong { found, most }),
        }
    }

    /// A sequence of at most `most` items.
    pub(crate) fn sequence<T: Cdr>(&mut self, items: &[T], most: usize) -> Result<(), CdrFault> {
        self.length(items.len(), most)?;
        T::write_all(items, self)
    }
}

/// `value` with its encapsulation, little-endian; an error names no field, because a value that cannot be written is
/// this program's own fault.
pub(crate) fn to_bytes<T: Cdr>(value: &T, most: usize) -> Result<Vec<u8>, CdrError> {
    let mut out = Writer::default();
    value.write(&mut out).map_err(|fault| fault.at("message"))?;
    let found = out.content.len() + ENCAPSULATION;
    if found > most {
        return Err(CdrFault::TooLong { found, most }.at("message"));
    }
    Ok([&[0, 1, 0, 0], &out.content[..]].concat())
}

/// The value in a payload of at most `most` bytes.
pub(crate) fn from_bytes<T: Cdr>(payload: &[u8], most: usize) -> Result<T, CdrError> {
    if payload.len() > most {
        return Err(CdrFault::TooLong { found: payload.len(), most }.at("message"));
    }
    let Some(([high, low, _, _], content)) = payload.split_first_chunk::<ENCAPSULATION>() else {
        return Err(CdrFault::Short.at("message"));
    };
    let little = match (high, low) {
        (0, 0) => false,
        (0, 1) => true,
        _ => return Err(CdrFault::Encapsulation(u16::from_be_bytes([*high, *low])).at("message")),
    };
    let mut input = Reader { content, at: 0, little };
    let value = T::read(&mut input)?;
    match input.left() {
        left if left > PADDING_MAX => Err(CdrFault::Trailing(left).at("message")),
        _ => Ok(value),
    }
}

/// Reads the content of one message.
#[derive(Debug)]
pub struct Reader<'a> {
    content: &'a [u8],
    at: usize,
    little: bool,
}

impl<'a> Reader<'a> {
    fn left(&self) -> usize {
        self.content.len().saturating_sub(self.at)
    }

    fn take(&mut self, bytes: usize) -> Result<&'a [u8], CdrError> {
        let taken = self.at.checked_add(bytes).and_then(|end| self.content.get(self.at..end));
        let taken = taken.ok_or(CdrFault::Short.at("message"))?;
        self.at += bytes;
        Ok(taken)
    }

    fn align(&mut self, size: usize) {
        self.at = self.at.next_multiple_of(size);
    }

    /// A sequence of at most `most` items.
    pub(crate) fn sequence<T: Cdr>(&mut self, field: &'static str, most: usize) -> Result<Vec<T>, CdrError> {
        let found = u32::read(self)? as usize;
        if found > most {
            return Err(CdrFault::TooLong { found, most }.at(field));
        }
        if found.saturating_mul(T::MIN_BYTES) > self.left() {
            return Err(CdrFault::Short.at(field));
        }
        T::read_all(self, found)
    }
}

/// Names the field in which something was wrong, unless one inside of it is named already.
pub(crate) fn named<T>(field: &'static str, read: Result<T, CdrError>) -> Result<T, CdrError> {
    read.map_err(|error| if error.field == "message" { error.fault.at(field) } else { error })
}

macro_rules! numbers {
    ($($ty:ty),*) => {$(
        impl Cdr for $ty {
            const MIN_BYTES: usize = size_of::<$ty>();

            fn write(&self, out: &mut Writer) -> Result<(), CdrFault> {
                out.align(size_of::<$ty>());
                out.content.extend_from_slice(&self.to_le_bytes());
                Ok(())
            }

            fn read(input: &mut Reader<'_>) -> Result<Self, CdrError> {
                input.align(size_of::<$ty>());
                let bytes = input.take(size_of::<$ty>())?;
                let bytes = bytes.try_into().map_err(|_| CdrFault::Short.at("message"))?;
                Ok(if input.little { Self::from_le_bytes(bytes) } else { Self::from_be_bytes(bytes) })
            }

            fn read_all(input: &mut Reader<'_>, count: usize) -> Result<Vec<Self>, CdrError> {
                if count == 0 {
                    return Ok(Vec::new());
                }
                input.align(size_of::<$ty>());
                let bytes = input.take(count.saturating_mul(size_of::<$ty>()))?;
                let (chunks, _) = bytes.as_chunks();
                let read = if input.little { Self::from_le_bytes } else { Self::from_be_bytes };
                Ok(chunks.iter().map(|chunk| read(*chunk)).collect())
            }
        }
    )*};
}
numbers!(i8, u8, i16, u16, i32, u32, i64, u64, f32, f64);

impl Cdr for bool {
    const MIN_BYTES: usize = 1;

    fn write(&self, out: &mut Writer) -> Result<(), CdrFault> {
        u8::from(*self).write(out)
    }

    fn read(input: &mut Reader<'_>) -> Result<Self, CdrError> {
        match u8::read(input)? {
            0 => Ok(false),
            1 => Ok(true),
            other => Err(CdrFault::Bool(other).at("message")),
        }
    }
}

impl Cdr for String {
    const MIN_BYTES: usize = 4;

    fn write(&self, out: &mut Writer) -> Result<(), CdrFault> {
        if self.contains('\0') {
            return Err(CdrFault::Text);
        }
        out.length(self.len() + 1, limits::TEXT + 1)?;
        out.content.extend_from_slice(self.as_bytes());
        out.content.push(0);
        Ok(())
    }

    fn read(input: &mut Reader<'_>) -> Result<Self, CdrError> {
        let found = u32::read(input)? as usize;
        let most = limits::TEXT + 1;
        if found > most {
            return Err(CdrFault::TooLong { found, most }.at("message"));
        }
        // Some writers give an empty text no NUL.
        let text = match input.take(found)? {
            [] => &[],
            [text @ .., 0] if !text.contains(&0) => text,
            _ => return Err(CdrFault::Text.at("message")),
        };
        str::from_utf8(text).map(str::to_owned).map_err(|_| CdrFault::Text.at("message"))
    }
}

impl<T: Cdr + Default + Copy, const N: usize> Cdr for [T; N] {
    const MIN_BYTES: usize = N * T::MIN_BYTES;

    fn write(&self, out: &mut Writer) -> Result<(), CdrFault> {
        T::write_all(self, out)
    }

    fn read(input: &mut Reader<'_>) -> Result<Self, CdrError> {
        let mut items = [T::default(); N];
        for item in &mut items {
            *item = T::read(input)?;
        }
        Ok(items)
    }
}
