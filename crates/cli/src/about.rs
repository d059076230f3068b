//! `curionav --version --verbose`: what this program is and what is inside.

use curionav_runtime::exit::{Exit, SUCCESS};
use curionav_runtime::print::print;

/// Every crate that the program links with, one `name version licence` per line, as
/// `deploy/licences.py` writes them.
const LICENCES: &str = include_str!("../licences.txt");

/// Whether this is asked for. `--version` alone is the argument parser's.
pub(crate) fn is_wanted(arguments: impl Iterator<Item = String>) -> bool {
    let arguments: Vec<String> = arguments.collect();
    matches!(
        arguments.iter().map(String::as_str).collect::<Vec<_>>()[..],
        ["--version" | "-V", "--verbose" | "-v"] | ["--verbose" | "-v", "--version" | "-V"]
    )
}

/// Prints it.
pub(crate) fn show() -> Result<u8, Exit> {
    print(text())?;
    Ok(SUCCESS)
}

fn text() -> String {
    format!(
        "curionav {version}\n\
         commit: {commit}\n\
         target: {architecture}-{system}{libc}\n\
         licence: Apache-2.0\n\
         \n\
         What it contains, besides Rust's standard library (MIT OR Apache-2.0):\n\
         {LICENCES}",
        version = env!("CARGO_PKG_VERSION"),
        // Whatever builds a release sets it.
        commit = option_env!("CURIONAV_COMMIT").unwrap_or("unknown"),
        architecture = std::env::consts::ARCH,
        system = std::env::consts::OS,
        libc = match (cfg!(target_env = "gnu"), cfg!(target_env = "musl")) {
            (true, _) => "-gnu",
            (_, true) => "-musl",
            _ => "",
        },
    )
    .trim_end()
    .to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_shown_for_both_flags_and_nothing_else() {
        let wanted = |text: &str| is_wanted(text.split_whitespace().map(str::to_owned));
        assert!(wanted("--version --verbose") && wanted("-v -V"));
        assert!(!wanted("--version") && !wanted("--verbose") && !wanted("run --version --verbose"));
    }

    #[test]
    fn it_names_version_target_and_the_licence_of_the_network() {
        let text = text();
        assert!(text.starts_with(concat!("curionav ", env!("CARGO_PKG_VERSION"), "\ncommit: ")), "{text}");
        assert!(text.contains(std::env::consts::ARCH) && text.contains("\nzenoh 1."), "{text}");
        assert!(text.lines().any(|l| l.starts_with("zenoh ") && l.ends_with("Apache-2.0")), "{text}");
    }
}
