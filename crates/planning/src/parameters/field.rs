//! What is known about a field of a parameter struct: what it holds and what its numbers may be.

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

/// A field's name as files have it: Rust writes `r#` before a name that is a word of its own.
pub const fn plain(name: &'static str) -> &'static str {
    match name.as_bytes() {
        [b'r', b'#', ..] => name.split_at(2).1,
        _ => name,
    }
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

/// What a number may be, and why. Both ends belong to the range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Least value.
    pub least: f64,
    /// Greatest value.
    pub most: f64,
    /// Unit of the value; empty for shares and other plain numbers.
    pub unit: &'static str,
    /// Why it ends where it ends.
    pub why: &'static str,
}

impl Range {
    /// A coordinate of the map, metres: coordinates of a national grid fit in.
    pub const POSITION: Self =
        Self { least: -1e7, most: 1e7, unit: "m", why: "a map frame has its origin on the same continent" };
    /// A heading.
    pub const HEADING: Self = Self {
        least: -std::f64::consts::TAU,
        most: std::f64::consts::TAU,
        unit: "rad",
        why: "a turn either way; more is probably meant as degrees",
    };

    /// A share of something.
    pub const SHARE: Self = Self { least: 0.0, most: 1.0, unit: "", why: "it is a share" };
    /// Distance within which a point is reached, metres.
    pub const GOAL_TOLERANCE: Self = Self {
        least: 0.01,
        most: 10.0,
        unit: "m",
        why: "no pose is exact, and beyond some metres it is another place",
    };

    /// Whether `value` lies in it, as exactly as its ends are written; NaN lies in none.
    pub fn holds(&self, value: f64) -> bool {
        (self.least..=self.most).contains(&value)
            || value == as_written(self.least)
            || value == as_written(self.most)
    }

    /// The ends and the unit, as people write them: `0.01 to 1 s`.
    pub fn ends(&self) -> String {
        let gap = if self.unit.is_empty() { "" } else { " " };
        format!("{} to {}{gap}{}", end(self.least), end(self.most), self.unit)
    }

    /// What to do about a number that lies outside.
    pub fn mend(&self) -> String {
        format!("give {}: {}", self.ends(), self.why)
    }
}

/// The end of a range as a message names it, which may lie a little outside: 2 pi is written 6.2832.
fn as_written(value: f64) -> f64 {
    end(value).parse().unwrap_or(value)
}

/// The end of a range, such as pi, without the digits that do not matter.
fn end(value: f64) -> String {
    let whole = number(value);
    if whole.len() > 10 && !whole.contains('e') { format!("{value:.4}") } else { whole }
}

/// A number as people write it: short, and with an exponent where it would have many zeros.
pub(super) fn number(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && !(1e-4..1e6).contains(&size) { format!("{value:e}") } else { value.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_takes_the_ends_that_it_names() {
        let angle = |most: f64| Range { least: 0.01, most, unit: "rad", why: "" };
        for range in [Range::HEADING, Range::POSITION, angle(std::f64::consts::PI), angle(2.0 / 3e-3)] {
            let ends = range.ends();
            for end in ends.trim_end_matches(['r', 'a', 'd', 'm', ' ']).split(" to ") {
                assert!(range.holds(end.parse().unwrap()), "{end} of {ends}");
            }
            assert!(range.holds(range.least) && range.holds(range.most) && !range.holds(f64::NAN));
        }
        assert!(!Range::HEADING.holds(6.2833) && !Range::HEADING.holds(-6.29) && !Range::HEADING.holds(90.0));
    }
}
