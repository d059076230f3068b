//! Tests that cross the workspace, in one binary because Zenoh links slowly. One line a module.

#[cfg(test)]
mod deploy_files;
#[cfg(test)]
mod tidiness;
