//! The table as a part of `docs/security.md`.

use crate::name::pattern;
use crate::table::{OF_SERVICES, Right, Space, TABLE, Verb};

/// Where the part begins in the page.
pub const BEGIN: &str = "<!-- rights: `curionav secure rights` prints what follows -->\n";
/// Where it ends.
pub const END: &str = "<!-- end of rights -->\n";

/// The whole table in Markdown.
pub fn rights() -> String {
    let mut text = String::from("| certificate | is for | may | keys |\n|---|---|---|---|\n");
    for row in TABLE {
        let name =
            format!("`{}`", pattern(&row.role.replace("{term}", "TERM").replace("{planner}", "NAME"), row));
        text += &lines(&name, row.about, row.rights);
    }
    text + &lines("all services", "what their own names say", OF_SERVICES)
}

/// A line for each verb; name and purpose stand in the first one.
fn lines(name: &str, about: &str, rights: &[Right]) -> String {
    let mut lines = String::new();
    for verb in Verb::ALL {
        let keys: Vec<String> =
            rights.iter().filter(|right| right.verb == *verb).flat_map(in_words).collect();
        if !keys.is_empty() {
            let (name, about) = if lines.is_empty() { (name, about) } else { ("", "") };
            lines += &format!("| {name} | {about} | {} | {} |\n", verb.word(), keys.join(", "));
        }
    }
    lines
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
