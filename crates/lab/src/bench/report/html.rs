//! Text and tables as HTML.

/// Text that cannot break out of where it is put.
pub(super) fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            _ => safe.push(c),
        }
    }
    safe
}

/// Text with what stands between backticks as code.
pub(super) fn prose(text: &str) -> String {
    let parts = text.split('`').enumerate();
    parts
        .map(|(i, part)| if i % 2 == 1 { format!("<code>{}</code>", escaped(part)) } else { escaped(part) })
        .collect()
}

/// A cell; `class` may be empty.
pub(super) fn td(class: &str, content: &str) -> String {
    if class.is_empty() {
        format!("<td>{content}</td>")
    } else {
        format!("<td class=\"{class}\">{content}</td>")
    }
}

pub(super) fn th(content: &str) -> String {
    format!("<th>{}</th>", escaped(content))
}

/// A table from its finished rows.
pub(super) fn table(class: &str, head: &[String], rows: &[String]) -> String {
    let line = |cells: &String| format!("<tr>{cells}</tr>\n");
    let head: String = head.iter().map(line).collect();
    let rows: String = rows.iter().map(line).collect();
    format!("<table class=\"{class}\">\n<thead>\n{head}</thead>\n<tbody>\n{rows}</tbody>\n</table>\n")
}

/// A planner's name beside its colour.
pub(super) fn planner(name: &str, index: usize) -> String {
    let colour = curionav_picture::planner_colour(name, index);
    format!("<span class=\"key\" style=\"background:{colour}\"></span>{}", escaped(name))
}
