//! Parameter structs that say beside each field what it means, what it is by default and what it may be.
//!
//! [`parameters!`](crate::parameters!) declares such a struct. The same declaration makes its `Default`, the check of
//! its numbers ([`Ranged::check`]) and what a reference page lists ([`Ranged::FIELDS`]), so none of them can differ
//! from another. A range is closed at both ends and holds whatever the struct is read from: a file, a message, the
//! search of `curionav tune`.

mod declare;
mod error;
mod field;
mod ranged;
mod read;
mod reference;

pub use error::{FieldError, range_of};
pub use field::{Field, Kind, Range, Word, Words, plain, word};
pub use ranged::{Numbers, Ranged, check_name, check_numbers, check_table};
pub use read::{field_line, read, read_table};
pub use reference::reference;
