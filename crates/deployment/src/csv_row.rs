//! One record of a CSV file (RFC 4180).

/// The fields with commas between, quoted where they must be, and a line break.
pub fn csv_row(fields: impl IntoIterator<Item = impl AsRef<str>>) -> String {
    let quoted: Vec<String> = fields.into_iter().map(|text| field(text.as_ref())).collect();
    quoted.join(",") + "\n"
}

/// Quoted where it must be, quotes within doubled.
fn field(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commas_quotes_and_line_breaks_are_quoted() {
        assert_eq!(csv_row(["a", "b,c", "say \"no\"", "d\ne"]), "a,\"b,c\",\"say \"\"no\"\"\",\"d\ne\"\n");
    }
}
