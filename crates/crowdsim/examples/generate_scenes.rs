//! Writes the drawn scenes: `generate_scenes OUTDIR`, from the project's root with `scenarios` as the folder
//! to renew what is committed. Prints what each scene turned out to be like.

use std::path::Path;

use curionav_crowdsim::paper;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let Some(folder) = std::env::args().nth(1) else {
        return Err("usage: generate_scenes OUTDIR".into());
    };
    for scene in [paper::environment(4, "s2", paper::SEED)?, paper::quickstart(paper::SEED)?] {
        eprintln!("{}\n{}", scene.scenario.name, paper::check(&scene));
    }
    for (path, bytes) in paper::committed()? {
        let path = Path::new(&folder).join(path);
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent)?;
        }
        std::fs::write(path, bytes)?;
    }
    Ok(())
}
