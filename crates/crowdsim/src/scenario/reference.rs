//! The reference page of the scenario file, made from the declarations of its fields.

use curionav_planning::hrvo::HrvoParams;
use curionav_planning::parameters::{Ranged, reference};
use toml::{Table, Value};

use super::{PeopleParams, PeopleSource, Scenario};
use crate::social_force::SocialForceParams;

/// The shortest scenario with one entry in each list.
const SHORTEST: &str = r#"name = "n"
map = { file = "f" }
robot = { start = [0, 0, 0], goal = [1, 0] }
walkers = [{ route = [[0, 0], [1, 0]] }]
crowds = [{ count = 1, regions = [{ corners = [[0, 0], [1, 0], [1, 1]] }] }]
recorded = [{ file = "f", format = "text", fps = 25.0 }]
"#;

impl Scenario {
    /// Every field of a scenario file as Markdown: what it holds, its default, its range and its meaning.
    pub fn reference() -> Result<String, Box<dyn std::error::Error>> {
        let mut defaults = Table::try_from(Self::from_toml(SHORTEST)?)?;
        remove(&mut defaults, &SHORTEST.parse()?);
        // What a scenario without it leaves out when it is written.
        let PeopleParams { shape, kind, live_patience_s, motion, .. } = PeopleParams::default();
        if let Some(Value::Table(people)) = defaults.get_mut("people") {
            people.insert("shape".into(), Value::try_from(shape)?);
            people.insert("kind".into(), Value::try_from(kind)?);
            people.insert("live_patience_s".into(), live_patience_s.into());
            people.insert("motion".into(), Value::try_from(motion)?);
            people.insert("hrvo".into(), Value::try_from(HrvoParams::default())?);
            people.insert("social_force".into(), Value::try_from(SocialForceParams::default())?);
        }
        if let Some(Value::Table(perception)) = defaults.get_mut("perception") {
            perception.insert("source".into(), Value::try_from(PeopleSource::default())?);
        }
        Ok(reference(Self::FIELDS, &defaults))
    }
}

/// Takes out of `table` what `given` holds.
fn remove(table: &mut Table, given: &Table) {
    for (key, value) in given {
        match (table.get_mut(key), value) {
            (Some(Value::Table(inner)), Value::Table(value)) => remove(inner, value),
            (Some(Value::Array(entries)), Value::Array(values)) if values[0].is_table() => {
                for (entry, value) in entries.iter_mut().zip(values) {
                    if let (Value::Table(inner), Value::Table(value)) = (entry, value) {
                        remove(inner, value);
                    }
                }
            }
            _ => {
                table.remove(key);
            }
        }
    }
}
