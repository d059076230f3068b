//! Every numeric field of a file, found in the file itself, and what it is set to.

use curionav_planning::parameters::{Field, FieldError, Kind, range_of};
use toml::Value;

/// What every number is set to, one number at a time.
pub(super) const VALUES: [f64; 6] = [0.0, -1.0, 1e-12, 1e12, f64::NAN, f64::INFINITY];

/// A number of a document: its path, and whether the document writes it without a point.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Number {
    pub(super) path: String,
    is_whole: bool,
}

/// A document with one number changed.
pub(super) struct Cell {
    pub(super) path: String,
    pub(super) value: f64,
    pub(super) document: toml::Table,
}

/// Every number of `document`.
pub(super) fn numbers(document: &toml::Table) -> Vec<Number> {
    fn walk(path: &str, value: &Value, found: &mut Vec<Number>) {
        match value {
            Value::Integer(_) | Value::Float(_) => {
                found.push(Number { path: path.to_owned(), is_whole: value.is_integer() });
            }
            Value::Array(entries) => {
                entries.iter().enumerate().for_each(|(i, v)| walk(&format!("{path}[{i}]"), v, found));
            }
            Value::Table(table) => table.iter().for_each(|(k, v)| walk(&format!("{path}.{k}"), v, found)),
            _ => {}
        }
    }
    let mut found = Vec::new();
    document.iter().for_each(|(key, value)| walk(key, value, &mut found));
    found
}

/// `document` with each of its numbers set to each of [`VALUES`] and to both ends of its range.
pub(super) fn cells(document: &toml::Table, fields: &[Field]) -> Vec<Cell> {
    let mut cells = Vec::new();
    for number in numbers(document) {
        let range = range_of(&number.path, fields)
            .unwrap_or_else(|| panic!("{} is a number without a declared range", number.path));
        assert!(range.least < range.most && !range.why.is_empty(), "{}: {range:?}", number.path);
        let ends = [range.least, range.most].into_iter().filter(|end| !VALUES.contains(end));
        for value in VALUES.into_iter().chain(ends) {
            let mut document = document.clone();
            let whole = number.is_whole && value.fract() == 0.0;
            let written = if whole { Value::Integer(value as i64) } else { Value::Float(value) };
            *at(&mut document, &number.path) = written;
            cells.push(Cell { path: number.path.clone(), value, document });
        }
    }
    cells
}

/// The value at a path such as `walkers[0].route[1][0]`.
fn at<'a>(document: &'a mut toml::Table, path: &str) -> &'a mut Value {
    let mut segments = path.split(['.', '[']).map(|s| s.trim_end_matches(']'));
    let mut value = document.get_mut(segments.next().unwrap()).unwrap();
    for segment in segments {
        value = match value {
            Value::Array(entries) => &mut entries[segment.parse::<usize>().unwrap()],
            Value::Table(table) => table.get_mut(segment).unwrap(),
            other => panic!("{path} leads through {other}"),
        };
    }
    value
}

/// That a refusal names the line and the field that were changed, and says what to do.
pub(super) fn assert_names(error: &FieldError, text: &str, path: &str, value: f64) {
    let line = error.line.and_then(|n| text.lines().nth(n - 1)).unwrap_or_default();
    let last = error.field.rsplit('.').next().unwrap().split('[').next().unwrap();
    assert!(line.contains(last), "{path} = {value}: `{error}` points to the line `{line}`");
    assert!(!error.problem.is_empty() && !error.mend.is_empty(), "{path} = {value}: {error}");
    // What lies in its range may disagree with another number of the same table, which is then the one named.
    let table = |path: &str| path.rsplit_once('.').map(|(table, _)| table.to_owned());
    let disagrees = path.starts_with(&error.field) || table(&error.field) == table(path);
    // A polygon that is convex no more is at fault as a whole.
    let is_corner = error.field.ends_with("corners") && path.starts_with(&error.field);
    let same = error.field == path || is_corner || disagrees && !VALUES[1..].contains(&value);
    assert!(same, "{path} = {value}: `{error}` names another field");
}

/// That `document` leaves out no field: a reader that meets an unknown one lists all that it knows.
pub(super) fn assert_complete(document: &toml::Table, read: &dyn Fn(&str) -> Option<FieldError>) {
    let mut tables = vec![String::new()];
    fn walk(path: &str, value: &Value, tables: &mut Vec<String>) {
        match value {
            Value::Table(table) => {
                tables.push(path.to_owned());
                table.iter().for_each(|(k, v)| walk(&format!("{path}.{k}"), v, tables));
            }
            Value::Array(entries) => {
                entries.iter().enumerate().for_each(|(i, v)| walk(&format!("{path}[{i}]"), v, tables));
            }
            _ => {}
        }
    }
    document.iter().for_each(|(key, value)| walk(key, value, &mut tables));
    let mut looked_at = 0;
    for path in tables {
        let mut spoilt = document.clone();
        let table = match path.as_str() {
            "" => &mut spoilt,
            path => at(&mut spoilt, path).as_table_mut().unwrap(),
        };
        let there: Vec<String> = table.keys().cloned().collect();
        table.insert("no_such_field".into(), Value::Boolean(true));
        let error =
            read(&toml::to_string(&spoilt).unwrap()).unwrap_or_else(|| panic!("`{path}` takes any field"));
        let Some((_, known)) = error.problem.split_once("expected") else { continue };
        looked_at += 1;
        for name in known.split('`').skip(1).step_by(2) {
            // A footprint is a disc or a polygon, and a thing is that or a box; parameters of localiser, tracker and
            // planner are documents of their own.
            let is_elsewhere = match name {
                "radius" | "size" | "corners" if path.starts_with("world.objects") => true,
                "vertices" | "radius" => path.ends_with("footprint"),
                "localizer" | "tracker" | "profile" => path.is_empty(),
                _ => false,
            };
            assert!(is_elsewhere || there.iter().any(|t| t == name), "`{path}` lacks the field {name}");
        }
    }
    assert!(looked_at > 0);
}

/// How many of the fields are numbers.
pub(super) fn declared(fields: &[Field]) -> usize {
    let count = |field: &Field| match field.kind {
        Kind::Numbers(..) => 1,
        Kind::Table(inner, _) => declared(inner),
        Kind::Plain | Kind::Words(_) => 0,
    };
    fields.iter().map(count).sum()
}
