//! The reference page of a parameter struct, as Markdown.

use super::field::{Field, Kind, Range};

/// Lists every field below `prefix` with its kind, default, range and meaning. `defaults` is what stands in a file
/// that gives every field its default; a field that is not in it has none.
pub fn reference(fields: &[Field], defaults: &toml::Table) -> String {
    let mut text = String::new();
    table(&mut text, "", fields, Some(defaults));
    text
}

fn table(text: &mut String, path: &str, fields: &[Field], defaults: Option<&toml::Table>) {
    let default = |field: &Field| defaults.and_then(|table| table.get(field.name));
    for field in fields {
        let entries = match field.kind {
            Kind::Table(..) => continue,
            Kind::Numbers(_, entries) => entries,
            Kind::Plain | Kind::Words(_) => None,
        };
        let holds = match (field.kind, field.ty) {
            (Kind::Numbers(ranges, _), _) => numbers(field, ranges, entries),
            (Kind::Words(_), _) => "one of the words below".to_owned(),
            (_, "String" | "Option<String>") => "text".to_owned(),
            (_, "bool") => "true or false".to_owned(),
            (_, "Option<toml::Table>") => "table".to_owned(),
            // Of no file: the program fills it in.
            _ => continue,
        };
        let default = default(field).map_or(String::new(), |value| format!("; by default `{value}`"));
        *text +=
            &format!("- `{path}{}`: {holds}{default}.\n  {}\n", field.name, meaning(field.meaning, "  "));
        if let Kind::Numbers(ranges, _) = field.kind {
            let mut whys: Vec<&str> = ranges.iter().map(|range| range.why).collect();
            whys.dedup();
            *text += &format!("  The range: {}.\n", whys.join(";\n  "));
        }
        if let Kind::Words(words) = field.kind {
            for (word, lines) in words() {
                *text += &format!("  - `\"{word}\"`: {}\n", meaning(lines, "    "));
            }
        }
    }
    for field in fields {
        let Kind::Table(inner, entries) = field.kind else { continue };
        let (name, given) = match default(field) {
            // Of a list, the first entry shows the defaults.
            Some(toml::Value::Array(entries)) => (format!("{path}{}[]", field.name), entries.first()),
            Some(toml::Value::Table(map)) if entries.is_some() => {
                (format!("{path}{}.NAME", field.name), map.values().next())
            }
            given if field.ty.starts_with("Vec") => (format!("{path}{}[]", field.name), given),
            given => (format!("{path}{}", field.name), given),
        };
        let given = given.and_then(toml::Value::as_table);
        let count = entries.map_or(String::new(), |range| format!(" There may be {}.", range.ends()));
        *text += &format!("\n### `{name}`\n\n{}{count}\n\n", meaning(field.meaning, ""));
        table(text, &format!("{name}."), inner, given);
    }
}

fn numbers(field: &Field, ranges: &[Range], entries: Option<Range>) -> String {
    let whole =
        if field.ty.contains("u32") || field.ty.contains("usize") { "whole number" } else { "number" };
    let ends: Vec<String> = ranges.iter().map(Range::ends).collect();
    let what = match (entries, ranges.len() > 1 || field.ty.contains("Point2")) {
        (Some(entries), _) => format!("list of {}, each", entries.ends().replace("entries", "numbers")),
        (None, true) => "numbers".to_owned(),
        (None, false) => whole.to_owned(),
    };
    format!("{what} from {}", ends.join(", "))
}

/// The lines of a documentation comment, all but the first after `indent`.
fn meaning(lines: &[&str], indent: &str) -> String {
    lines.iter().map(|line| line.trim()).collect::<Vec<_>>().join(&format!("\n{indent}"))
}
