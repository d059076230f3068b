//! Files read and written, with errors that name them.

use std::fs;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use anyhow::Context;
use curionav_planning::occupancy::{MapYaml, OccupancyGrid, load_map};
use curionav_planning::text;

/// What is in a file.
pub fn bytes(path: &Path) -> anyhow::Result<Vec<u8>> {
    fs::read(path).with_context(|| format!("cannot read {}", path.display()))
}

/// The text in a file, without a byte-order mark.
pub fn text(path: &Path) -> anyhow::Result<String> {
    let bytes = bytes(path)?;
    let text = text::text(&bytes).map_err(|error| anyhow::anyhow!("{} {error}", path.display()))?;
    Ok(text.to_owned())
}

/// Whether the file begins with these bytes, of which no more are read.
pub fn begins_with(path: &Path, bytes: &[u8]) -> anyhow::Result<bool> {
    let mut first = Vec::with_capacity(bytes.len());
    let read = fs::File::open(path).and_then(|file| file.take(bytes.len() as u64).read_to_end(&mut first));
    read.with_context(|| format!("cannot read {}", path.display()))?;
    Ok(first == bytes)
}

/// Makes the directory, and those above it, if need be.
pub fn make_folder(path: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(path).with_context(|| format!("cannot create {}", path.display()))
}

/// Makes the directory if need be, and tries whether files can be written there: before a long run, not after it.
pub fn writable_folder(path: &Path) -> anyhow::Result<()> {
    make_folder(path)?;
    let trial = path.join(format!(".curionav-trial-{}", std::process::id()));
    fs::write(&trial, b"trial").with_context(|| format!("cannot write into {}", path.display()))?;
    fs::remove_file(&trial).with_context(|| format!("cannot remove {}", trial.display()))
}

/// Writes the file, in place of one that is there, and makes its directory if need be.
pub fn write(path: &Path, content: impl AsRef<[u8]>) -> anyhow::Result<()> {
    path.parent().map_or(Ok(()), make_folder)?;
    fs::write(path, content).with_context(|| format!("cannot write {}", path.display()))
}

/// A map as map_server has it: a YAML file, and the image that it names.
#[derive(Debug)]
pub struct MapFiles {
    /// The YAML file as it is.
    pub yaml_bytes: Vec<u8>,
    /// What it says.
    pub yaml: MapYaml,
    /// Where the image is.
    pub image_path: PathBuf,
    /// The image as it is.
    pub image: Vec<u8>,
}

impl MapFiles {
    /// Reads both. Errors name the file.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        Self::of(path, bytes(path)?, bytes)
    }

    /// What the YAML file says, and the image that it names, as `read_image` reads it.
    pub(crate) fn of(
        path: &Path,
        yaml_bytes: Vec<u8>,
        read_image: impl Fn(&Path) -> anyhow::Result<Vec<u8>>,
    ) -> anyhow::Result<Self> {
        let text =
            text::loose_text(&yaml_bytes).map_err(|error| anyhow::anyhow!("{} {error}", path.display()))?;
        let yaml = MapYaml::parse(&text).with_context(|| path.display().to_string())?;
        let image_path = path.parent().unwrap_or(Path::new("")).join(&yaml.image);
        let image = read_image(&image_path).with_context(|| format!("{}: image", path.display()))?;
        Ok(Self { yaml_bytes, yaml, image_path, image })
    }

    /// The map itself.
    pub fn grid(&self) -> anyhow::Result<OccupancyGrid> {
        load_map(&self.yaml, &self.image).with_context(|| self.image_path.display().to_string())
    }
}
