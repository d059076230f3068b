//! Writes the drawn scenes into a folder: `generate_scenes OUTDIR [SEED]`, from the project's root with
//! `scenarios` as the folder to renew what is committed. Prints what each scene turned out to be like.

use std::path::Path;

use curionav_crowdsim::paper::{self, PaperScene};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some(folder) = arguments.first() else {
        return Err("usage: generate_scenes OUTDIR [SEED]".into());
    };
    let seed = arguments.get(1).map_or(Ok(paper::SEED), |s| s.parse())?;
    let folder = Path::new(folder);
    write(&folder.join("paper"), &paper::environment(4, "s2", seed)?)?;
    write(folder, &paper::quickstart(seed)?)
}

fn write(folder: &Path, scene: &PaperScene) -> Result<(), Box<dyn std::error::Error>> {
    let report = paper::check(scene);
    eprintln!("{}\n{report}", scene.scenario.name);
    for (path, bytes) in paper::files(scene)? {
        let path = folder.join(path);
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent)?;
        }
        std::fs::write(path, bytes)?;
    }
    Ok(())
}
