//! What is known about a field of a parameter struct.

use super::range::Range;

/// A field of a parameter struct.
#[derive(Debug, Clone, Copy)]
pub struct Field {
    /// Name, as in files.
    pub name: &'static str,
    /// Its Rust type.
    pub ty: &'static str,
    /// What it means, line by line.
    pub meaning: &'static [&'static str],
    /// What it holds.
    pub kind: Kind,
}

/// What a field holds.
#[derive(Debug, Clone, Copy)]
pub enum Kind {
    /// A text, or yes or no.
    Plain,
    /// One of some words, each with its meaning.
    Words(fn() -> Vec<Word>),
    /// One number or several: the ranges apply in turn. For a list also how many there may be.
    Numbers(&'static [Range], Option<Range>),
    /// Fields of its own, and for a list of tables how many there may be.
    Table(&'static [Field], Option<Range>),
}

/// A word and the lines that say what it means.
pub type Word = (String, &'static [&'static str]);

/// What can be one of some words.
pub trait Words {
    /// All of them.
    fn words() -> Vec<Word>;
}

/// A value of an enum as a file has it.
pub fn word<T: serde::Serialize>(value: &T) -> String {
    struct Shown<'a, T>(&'a T);
    impl<T: serde::Serialize> std::fmt::Display for Shown<'_, T> {
        fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            self.0.serialize(f)
        }
    }
    Shown(value).to_string()
}
