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
trait Element: Copy {
    fn read(bytes: &[u8]) -> Option<Vec<Self>>;
    /// Without a copy where the machine has this order itself.
    fn write(values: &[Self]) -> Cow<'_, [u8]>;
}

macro_rules! element {
    ($($number:ty),*) => {$(
        impl Element for $number {
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
element!(f64, f32, u32, i8, u8);

/// The content of a typed array, without its tag.
struct Elements<T>(Vec<T>);

impl<'de, T: Element> Deserialize<'de> for Elements<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_byte_buf(ElementsVisitor(PhantomData))
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

    fn visit_byte_buf<E: de::Error>(self, bytes: Vec<u8>) -> Result<Self::Value, E> {
        self.visit_bytes(&bytes)
    }
}

macro_rules! typed_array {
    ($(#[$doc:meta])* $name:ident, $number:ty, $tag:literal) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Default, PartialEq)]
        pub struct $name(pub Vec<$number>);

        impl $name {
            /// The RFC 8746 tag in front of the bytes.
            pub const TAG: u64 = $tag;
        }

        impl Deref for $name {
            type Target = [$number];
            fn deref(&self) -> &[$number] {
                &self.0
            }
        }

        impl From<Vec<$number>> for $name {
            fn from(values: Vec<$number>) -> Self {
                Self(values)
            }
        }

        impl From<&[$number]> for $name {
            fn from(values: &[$number]) -> Self {
                Self(values.to_vec())
            }
        }

        impl FromIterator<$number> for $name {
            fn from_iter<I: IntoIterator<Item = $number>>(values: I) -> Self {
                Self(values.into_iter().collect())
            }
        }

        impl Serialize for $name {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                Captured(Some(Self::TAG), serde_bytes::Bytes::new(&Element::write(&self.0))).serialize(serializer)
            }
        }

        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                match Captured::<Elements<$number>>::deserialize(deserializer)? {
                    Captured(Some(Self::TAG), Elements(values)) => Ok(Self(values)),
                    Captured(Some(tag), _) => Err(de::Error::custom(format_args!(
                        "expected a typed array with tag {}, found tag {tag}", Self::TAG
                    ))),
                    Captured(None, _) => Err(de::Error::custom(format_args!(
                        "expected a typed array with tag {}, found an untagged byte string", Self::TAG
                    ))),
                }
            }
        }
    };
}

typed_array! {
    /// IEEE 754 binary64, little-endian (tag 86); `numpy.frombuffer(b, "<f8")`.
    F64Array, f64, 86
}
typed_array! {
    /// IEEE 754 binary32, little-endian (tag 85); `numpy.frombuffer(b, "<f4")`.
    F32Array, f32, 85
}
typed_array! {
    /// Unsigned 32-bit, little-endian (tag 70); `numpy.frombuffer(b, "<u4")`.
    U32Array, u32, 70
}
typed_array! {
    /// Signed 8-bit (tag 72); `numpy.frombuffer(b, "i1")`.
    I8Array, i8, 72
}
typed_array! {
    /// Unsigned 8-bit (tag 64); `numpy.frombuffer(b, "u1")`.
    U8Array, u8, 64
}
