//! `report.html`: one file that needs nothing else, on screen and on paper. `templates/report.html` is how it looks.

mod page;
mod short;
mod words;

use askama::Template;

use super::findings::Findings;
use page::Page;

pub(super) fn report(bench: &Findings<'_>) -> anyhow::Result<String> {
    let mut page = Page::new(bench);
    page.in_short = short::sentences(&page);
    // The engine drops the last line break of a template.
    Ok(page.render()? + "\n")
}

#[cfg(test)]
mod tests;
