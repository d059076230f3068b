//! The table as a part of `docs/security.md`.

use std::fmt::Write;

use crate::name::pattern;
use crate::table::{OF_SERVICES, Right, Space, TABLE, Verb};

/// Where the part begins and ends in the page.
pub const BEGIN: &str = "<!-- rights: `curionav secure rights` prints what follows -->\n";
/// See [`BEGIN`].
pub const END: &str = "<!-- end of rights -->\n";

/// The whole table in Markdown.
pub fn rights() -> String {
    let mut text = String::from("| certificate | is for | may | keys |\n|---|---|---|---|\n");
    let mut add = |name: String, about: &str, rights: &[Right]| {
        let mut name = name;
        let mut about = about;
        for &verb in Verb::ALL {
            let keys: Vec<String> =
                rights.iter().filter(|right| right.verb == verb).flat_map(in_words).collect();
            if !keys.is_empty() {
                // Writing to a string cannot fail.
                let _ = writeln!(text, "| {name} | {about} | {} | {} |", verb.word(), keys.join(", "));
                name = String::new();
                about = "";
            }
        }
    };
    for row in TABLE {
        add(format!("`{}`", pattern(&row.role.replace("{term}", "TERM"), row)), row.about, row.rights);
    }
    add("all services".into(), "what their own names say", OF_SERVICES);
    text
}

fn in_words(right: &Right) -> Vec<String> {
    let space = if right.space == Space::Router { " (without namespace)" } else { "" };
    right.keys.iter().map(|key| format!("`{}`{space}", key.replace("{role}", "{term}"))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_says_what_the_table_says() {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/security.md");
        let page = std::fs::read_to_string(file).unwrap();
        let (_, rest) = page.split_once(BEGIN).expect("a begin of rights");
        let (part, _) = rest.split_once(END).expect("an end of rights");
        let mend = "put what `curionav secure rights` prints into docs/security.md";
        assert_eq!(part.trim(), rights().trim(), "{mend}");
    }
}
