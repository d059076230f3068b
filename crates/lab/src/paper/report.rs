//! What a scene turned out to be like, and what it falls short of.

use std::fmt;

/// A property of a scene and the range it should be in; both ends belong to it.
#[derive(Debug, Clone)]
pub(super) struct Property {
    pub(super) what: String,
    pub(super) value: f64,
    least: f64,
    most: f64,
}

/// What a scene turned out to be like: lengths in metres, speeds in m/s, angles in radians.
#[derive(Debug, Clone, Default)]
pub struct Report {
    pub(super) properties: Vec<Property>,
}

impl Report {
    pub(super) fn add(&mut self, what: impl Into<String>, value: f64, (least, most): (f64, f64)) {
        self.properties.push(Property { what: what.into(), value, least, most });
    }

    /// What the scene falls short of, one line each; empty when it is as it should be.
    pub fn faults(&self) -> Vec<String> {
        self.properties.iter().filter_map(Property::fault).collect()
    }
}

impl Property {
    fn fault(&self) -> Option<String> {
        let Self { what, value, least, most } = self;
        if value >= least && value <= most {
            None
        } else if least == most {
            Some(format!("{value} {what}, not {most}"))
        } else {
            Some(format!("{what} is {value:.3}, not between {least:.3} and {most:.3}"))
        }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for property in &self.properties {
            writeln!(f, "  {} {:.3}", property.what, property.value)?;
        }
        self.faults().iter().try_for_each(|fault| writeln!(f, "  fault: {fault}"))
    }
}
