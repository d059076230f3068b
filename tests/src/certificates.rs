//! Certificates of what a test starts.

use curionav_security::folder::{Folder, days};
use curionav_security::name::Name;
use tempfile::TempDir;

/// A folder with an authority and certificates of these names; those of routers hold these addresses as well.
pub(crate) fn issued(names: impl IntoIterator<Item = Name>, addresses: &[String]) -> TempDir {
    let directory = tempfile::tempdir().unwrap();
    let folder = Folder::new(directory.path());
    folder.init(None).unwrap();
    names.into_iter().for_each(|name| folder.issue(&name, addresses, days(1)).unwrap());
    directory
}

/// What tells a program of them, if there are any.
pub(crate) fn secure(folder: Option<&TempDir>) -> Vec<String> {
    folder.map_or_else(Vec::new, |folder| vec!["--secure".into(), folder.path().display().to_string()])
}
