//! Tests that cross the workspace, in one binary because Zenoh links slowly. One line a module.

#[cfg(test)]
mod certificates;
#[cfg(test)]
mod deploy_containers;
#[cfg(test)]
mod deploy_files;
#[cfg(test)]
mod end_to_end;
#[cfg(test)]
mod every_number;
#[cfg(test)]
mod faults;
#[cfg(test)]
mod films;
#[cfg(test)]
mod foreign_bytes;
#[cfg(test)]
mod intruder;
#[cfg(test)]
mod invariants;
#[cfg(test)]
mod network;
#[cfg(test)]
mod pace;
#[cfg(test)]
mod robot_services;
#[cfg(test)]
mod ros2;
#[cfg(test)]
mod soak;
#[cfg(test)]
mod tidiness;
#[cfg(test)]
mod tracking;
