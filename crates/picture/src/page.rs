//! The page that all pictures share: its measures, its parts, and which characters it may hold.

use super::palette::style_sheet;
use super::viewport::px;
use svg::node::element::{Definitions, Group, Rectangle, SVG, Style, Title};

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

/// A file of `width` x `height` pixels on white ground, to which its parts are added.
pub(super) fn document(title: &str, (width, height): (f64, f64), definitions: Definitions) -> SVG {
    SVG::new()
        .set("width", px(width))
        .set("height", px(height))
        .set("viewBox", format!("0 0 {} {}", px(width), px(height)))
        .add(Title::new(title))
        .add(Style::new(style_sheet()))
        .add(definitions)
        .add(rectangle(width, height, "#fff"))
}

pub(super) fn file(document: &SVG) -> String {
    format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{}\n", printable(&document.to_string()))
}

/// The text without the characters that XML does not allow, which a name or a reason might hold.
pub(super) fn printable(text: &str) -> String {
    text.chars().filter(|c| matches!(c, '\t' | '\n' | '\r' | ' '..='\u{fffd}' | '\u{10000}'..)).collect()
}

/// What shows nothing of its content beyond `width` and `height`, px.
pub(super) fn pane(width: f64, height: f64) -> SVG {
    SVG::new().set("width", px(width)).set("height", px(height))
}

pub(super) fn rectangle(width: f64, height: f64, fill: &str) -> Rectangle {
    Rectangle::new().set("width", px(width)).set("height", px(height)).set("fill", fill)
}

/// The attribute `transform` that moves by `x` and `y` pixels.
pub(super) fn translate(x: f64, y: f64) -> String {
    format!("translate({} {})", px(x), px(y))
}

/// A part of the page, drawn from its own origin.
pub(super) struct Panel {
    pub(super) content: Group,
    pub(super) width: f64,
    pub(super) height: f64,
}

pub(super) struct Column {
    pub(super) parts: Vec<Group>,
    pub(super) bottom: f64,
}

impl Column {
    /// A panel beside the one that is added next.
    pub(super) fn add_beside(&mut self, left: f64, panel: Panel) {
        self.parts.push(Group::new().set("transform", translate(left, self.bottom)).add(panel.content));
    }

    pub(super) fn add(&mut self, left: f64, panel: Panel) {
        let height = panel.height;
        self.add_beside(left, panel);
        self.bottom += height + GAP;
    }

    pub(super) fn add_row(&mut self, mut left: f64, gap: f64, panels: Vec<Panel>) {
        let height = panels.iter().map(|panel| panel.height).fold(0.0, f64::max);
        for panel in panels {
            let width = panel.width;
            self.add_beside(left, panel);
            left += width + gap;
        }
        self.bottom += height;
    }
}
