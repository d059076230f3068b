//! Arrays of numbers as RFC 8746 typed arrays: a tag that names the element, over one little-endian byte string.
//!
//! The shape is never in the array; it stands in fields beside it (`count`, `steps`, `width`, ...), row-major,
//! and is checked against the length when a message is validated.

use ciborium::tag::Captured;
use serde::de::{self, Deserialize, Deserializer, Visitor};
use serde::ser::{Serialize, Serializer};
use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;
use std::ops::Deref;

/// A number with a fixed little-endian form.
pub trait Element: Copy {
    /// The RFC 8746 tag in front of the bytes.
    const TAG: u64;

    /// Nothing if the last number is incomplete.
    fn read(bytes: &[u8]) -> Option<Vec<Self>>;

    /// Without a copy where the machine has this order itself.
    fn write(values: &[Self]) -> Cow<'_, [u8]>;
}

macro_rules! element {
    ($($number:ty, $tag:literal;)*) => {$(
        impl Element for $number {
            const TAG: u64 = $tag;

            fn read(bytes: &[u8]) -> Option<Vec<Self>> {
                let (chunks, rest) = bytes.as_chunks::<{ size_of::<$number>() }>();
                rest.is_empty().then(|| chunks.iter().map(|chunk| <$number>::from_le_bytes(*chunk)).collect())
            }

            fn write(values: &[Self]) -> Cow<'_, [u8]> {
                if cfg!(target_endian = "little") {
                    return Cow::Borrowed(bytemuck::cast_slice(values));
                }
                Cow::Owned(values.iter().flat_map(|value| value.to_le_bytes()).collect())
            }
        }
    )*};
}
element! {
    f64, 86;
    f32, 85;
    u32, 70;
    i8, 72;
    u8, 64;
}

/// Numbers that travel as a typed array.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TypedArray<T>(pub Vec<T>);

/// IEEE 754 binary64, little-endian (tag 86); `numpy.frombuffer(b, "<f8")`.
pub type F64Array = TypedArray<f64>;
/// IEEE 754 binary32, little-endian (tag 85); `numpy.frombuffer(b, "<f4")`.
pub type F32Array = TypedArray<f32>;
/// Unsigned 32-bit, little-endian (tag 70); `numpy.frombuffer(b, "<u4")`.
pub type U32Array = TypedArray<u32>;
/// Signed 8-bit (tag 72); `numpy.frombuffer(b, "i1")`.
pub type I8Array = TypedArray<i8>;
/// Unsigned 8-bit (tag 64); `numpy.frombuffer(b, "u1")`.
pub type U8Array = TypedArray<u8>;

/// Numbers of another owner that are to travel as a typed array.
#[derive(Debug, Clone, Copy)]
pub struct TypedSlice<'a, T>(pub &'a [T]);

impl<T> Deref for TypedArray<T> {
    type Target = [T];
    fn deref(&self) -> &[T] {
        &self.0
    }
}

impl<T> From<Vec<T>> for TypedArray<T> {
    fn from(values: Vec<T>) -> Self {
        Self(values)
    }
}

impl<T: Copy> From<&[T]> for TypedArray<T> {
    fn from(values: &[T]) -> Self {
        Self(values.to_vec())
    }
}

impl<T> FromIterator<T> for TypedArray<T> {
    fn from_iter<I: IntoIterator<Item = T>>(values: I) -> Self {
        Self(values.into_iter().collect())
    }
}

impl<T: Element> Serialize for TypedArray<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        TypedSlice(&self.0).serialize(serializer)
    }
}

impl<T: Element> Serialize for TypedSlice<'_, T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Captured(Some(T::TAG), serde_bytes::Bytes::new(&T::write(self.0))).serialize(serializer)
    }
}

impl<'de, T: Element> Deserialize<'de> for TypedArray<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Captured(tag, Elements(values)) = Captured::deserialize(deserializer)?;
        let found = match tag {
            Some(tag) if tag == T::TAG => return Ok(Self(values)),
            Some(tag) => format!("tag {tag}"),
            None => "an untagged byte string".to_owned(),
        };
        Err(de::Error::custom(format_args!("expected a typed array with tag {}, found {found}", T::TAG)))
    }
}

/// The content of a typed array, without its tag.
struct Elements<T>(Vec<T>);

impl<'de, T: Element> Deserialize<'de> for Elements<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_bytes(ElementsVisitor(PhantomData))
    }
}

struct ElementsVisitor<T>(PhantomData<T>);

impl<T: Element> Visitor<'_> for ElementsVisitor<T> {
    type Value = Elements<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a byte string of {}-byte elements", size_of::<T>())
    }

    fn visit_bytes<E: de::Error>(self, bytes: &[u8]) -> Result<Self::Value, E> {
        T::read(bytes).map(Elements).ok_or_else(|| E::invalid_length(bytes.len(), &self))
    }
}
