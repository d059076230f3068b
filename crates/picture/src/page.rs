//! The page that all pictures share: its measures, its parts, and which characters it may hold.

use super::viewport::px;
use svg::node::element::Group;

/// Width of the page, px.
pub(super) const WIDTH: f64 = 1200.0;
/// Free rim of the page, px.
pub(super) const RIM: f64 = 26.0;
/// Greatest height of the map, px.
pub(super) const MAP_HEIGHT: f64 = 780.0;
/// From one part of the page to the next, px.
pub(super) const GAP: f64 = 22.0;
/// The map's name in the document.
pub(super) const MAP_ID: &str = "map";

/// A part of the page, drawn from its own origin.
pub(super) struct Panel {
    pub(super) content: Group,
    pub(super) width: f64,
    pub(super) height: f64,
}

/// The text without the characters that XML does not allow, which a name or a reason might hold.
pub(super) fn printable(text: &str) -> String {
    text.chars().filter(|c| matches!(c, '\t' | '\n' | '\r' | ' '..='\u{fffd}' | '\u{10000}'..)).collect()
}

/// Panels below each other.
pub(super) struct Column {
    pub(super) parts: Vec<Group>,
    pub(super) bottom: f64,
}

impl Column {
    fn place(&mut self, left: f64, panel: Panel) {
        let at = format!("translate({} {})", px(left), px(self.bottom));
        self.parts.push(Group::new().set("transform", at).add(panel.content));
    }

    pub(super) fn add(&mut self, left: f64, panel: Panel) {
        let height = panel.height;
        self.place(left, panel);
        self.bottom += height + GAP;
    }

    /// A panel beside the one that is added next.
    pub(super) fn add_beside(&mut self, left: f64, panel: Panel) {
        self.place(left, panel);
    }

    /// Panels beside each other.
    pub(super) fn add_row(&mut self, left: f64, gap: f64, panels: Vec<Panel>) {
        let height = panels.iter().map(|panel| panel.height).fold(0.0, f64::max);
        let mut x = left;
        for panel in panels {
            let width = panel.width;
            self.place(x, panel);
            x += width + gap;
        }
        self.bottom += height;
    }
}
