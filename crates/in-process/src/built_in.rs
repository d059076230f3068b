//! Scenarios inside the program: they run without any file.

/// A scenario with the files that it names, as they are under `scenarios/`.
#[derive(Debug)]
pub struct BuiltIn {
    /// What commands call it.
    pub name: &'static str,
    /// The scenario's file.
    pub scenario: &'static str,
    /// The map's description, in `maps/NAME.yaml`.
    pub yaml: &'static [u8],
    /// The image that the description names, in `maps/NAME.pgm`.
    pub image: &'static [u8],
}

/// All of them.
pub static ALL: [BuiltIn; 1] = [BuiltIn {
    name: "quickstart",
    scenario: include_str!("../../../scenarios/quickstart.toml"),
    yaml: include_bytes!("../../../scenarios/maps/quickstart.yaml"),
    image: include_bytes!("../../../scenarios/maps/quickstart.pgm"),
}];
