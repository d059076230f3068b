//! Colours that people with any colour vision can tell apart, and the style sheet of the picture.
//!
//! Categories take the palette of Okabe and Ito (2008), costs the `viridis` map of Smith and van der Walt (2015).

/// Where the robot really was.
pub(super) const TRUTH: &str = "#0072B2";
/// Where it believed it was.
pub(super) const BELIEF: &str = "#D55E00";
pub(super) const GOAL: &str = "#009E73";
pub(super) const PERSON: &str = "#A6457F";
/// The crowds that the density model makes of people.
pub(super) const CROWD: &str = "#E69F00";
/// What is on no map.
pub(super) const THING: &str = "#B5A642";
/// Where the robot must not drive, and where it must be slow.
pub(super) const KEEPOUT: &str = "#f2b8b0";
pub(super) const SLOW: &str = "#f3d3a0";
/// The start, the chosen candidate and the text.
pub(super) const INK: &str = "#1a1a1a";
/// Limits and rejected candidates.
pub(super) const QUIET: &str = "#8a8a8a";
/// Behind the plots while localisation counts as uncertain.
pub(super) const UNCERTAIN: &str = "#F0E442";

/// `viridis` at equal steps from 0 to 1; the brightest yellow is left out, it would not show on white.
const VIRIDIS: [[f64; 3]; 8] = [
    [68.0, 1.0, 84.0],
    [71.0, 39.0, 119.0],
    [62.0, 73.0, 137.0],
    [48.0, 103.0, 141.0],
    [37.0, 130.0, 142.0],
    [30.0, 157.0, 136.0],
    [83.0, 197.0, 103.0],
    [181.0, 222.0, 43.0],
];

/// The colour of `share`, from 0 (dark: cheap) to 1 (bright: expensive).
pub(super) fn cost_colour(share: f64) -> String {
    let place = share.clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f64;
    let below = (place as usize).min(VIRIDIS.len() - 2);
    let rest = place - below as f64;
    let [r, g, b] =
        [0, 1, 2].map(|i| (VIRIDIS[below][i] * (1.0 - rest) + VIRIDIS[below + 1][i] * rest).round() as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// The style of everything that is not set on the element itself.
pub(super) fn style_sheet() -> String {
    [
        "text{font-family:Helvetica,Arial,'Liberation Sans','DejaVu Sans',sans-serif;font-size:11px;fill:#1a1a1a}",
        ".h1{font-size:21px;font-weight:bold}.h2{font-size:14px;font-weight:bold}.b{font-weight:bold}",
        ".s{font-size:10px;fill:#555}.halo{paint-order:stroke;stroke:#fff;stroke-width:3px;stroke-linejoin:round}",
        ".grid{stroke:#000;stroke-opacity:.08;stroke-width:1}.tick{stroke:#555;stroke-width:1}",
        ".frame{fill:none;stroke:#555;stroke-width:1}.line{fill:none;stroke-linejoin:round;stroke-linecap:round}",
        ".track{fill:none;stroke:#A6457F;stroke-opacity:.35;stroke-width:1.1;stroke-linejoin:round}",
        ".candidate{fill:none;stroke-width:1.1;stroke-opacity:.85;stroke-linejoin:round}",
        ".rejected{fill:none;stroke:#8a8a8a;stroke-width:.8;stroke-opacity:.7;stroke-dasharray:3 2}",
    ]
    .concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_of_the_scale_are_its_first_and_last_colour() {
        assert_eq!(cost_colour(0.0), "#440154");
        assert_eq!(cost_colour(1.0), "#b5de2b");
        assert_eq!([cost_colour(-3.0), cost_colour(7.0)], [cost_colour(0.0), cost_colour(1.0)]);
    }

    #[test]
    fn nan_has_a_colour_as_well() {
        assert_eq!(cost_colour(f64::NAN).len(), 7);
    }
}
