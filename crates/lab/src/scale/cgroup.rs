//! Processor quotas through Linux control groups, both versions.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::anyhow;

/// Length of a quota's period: short, so that a replica is never held up for long, and long enough for
/// [`QUOTA_MIN_US`] of 0.1 processors. With the kernel's default of 100 ms a replica of 0.1 processors would
/// compute for 10 ms and stand for 90.
const PERIOD_US: f64 = 10_000.0;
/// The least quota the kernel takes.
const QUOTA_MIN_US: f64 = 1000.0;
/// The longest period the kernel takes.
const PERIOD_MAX_US: f64 = 1_000_000.0;
/// How much more than an ordinary group ours weighs, so that the quota is what limits replicas, and not other
/// busy processes of the machine. They cannot use more than their quotas with it.
const WEIGHT: u64 = 100;
/// The weight of an ordinary group, by version.
const ORDINARY_SHARES: u64 = 1024;
const ORDINARY_WEIGHT: u64 = 100;
/// What our groups are called; the number of the process that made them follows.
const PREFIX: &str = "curionav-scale-";

fn refused(problem: String) -> anyhow::Error {
    anyhow!(
        "--cpu-quota: {problem}: it needs a Linux control group of the cpu controller in which this user may make \
         groups; run as root (in a container: with /sys/fs/cgroup writable), or leave --cpu-quota out"
    )
}

fn make(group: &Path) -> Result<(), String> {
    fs::create_dir(group).map_err(|e| format!("cannot make {}: {e}", group.display()))
}

fn write(path: &Path, content: &str) -> Result<(), String> {
    fs::write(path, content).map_err(|e| format!("cannot write {}: {e}", path.display()))
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Version {
    One,
    Two,
}

/// Groups of one process each; they are removed when this is dropped, after their processes have ended.
#[derive(Debug)]
pub(super) struct Quotas {
    version: Version,
    cores: f64,
    parent: PathBuf,
    groups: Vec<PathBuf>,
}

impl Quotas {
    /// Makes a group in which every process shall have `cores` processors.
    pub(super) fn new(cores: f64) -> anyhow::Result<Self> {
        let read = |file: &str| fs::read_to_string(file).unwrap_or_default();
        Self::below(&read("/proc/self/mounts"), &read("/proc/self/cgroup"), cores)
    }

    fn below(mounts: &str, own: &str, cores: f64) -> anyhow::Result<Self> {
        let mut problem = "no cpu controller is mounted".to_owned();
        for (version, home) in homes(mounts, own) {
            sweep(&home);
            match Self::made(version, &home, cores) {
                Ok(quotas) => return Ok(quotas),
                Err(error) => problem = error,
            }
        }
        Err(refused(problem))
    }

    fn made(version: Version, home: &Path, cores: f64) -> Result<Self, String> {
        if version == Version::Two {
            hand_down(home)?;
        }
        let parent = home.join(format!("{PREFIX}{}", std::process::id()));
        make(&parent)?;
        // From here on it is removed whatever happens.
        let quotas = Self { version, cores, parent, groups: Vec::new() };
        match version {
            Version::One => {
                write(&quotas.parent.join("cpu.shares"), &(WEIGHT * ORDINARY_SHARES).to_string())?;
            }
            Version::Two => {
                write(&quotas.parent.join("cpu.weight"), &(WEIGHT * ORDINARY_WEIGHT).to_string())?;
                hand_down(&quotas.parent)?;
            }
        }
        Ok(quotas)
    }

    pub(super) fn limit(&mut self, name: &str, pid: u32) -> anyhow::Result<()> {
        let group = self.parent.join(name);
        make(&group).map_err(refused)?;
        self.groups.push(group.clone());
        let (quota, period) = quota(self.cores);
        let settings = match self.version {
            Version::One => {
                vec![("cpu.cfs_period_us", period.to_string()), ("cpu.cfs_quota_us", quota.to_string())]
            }
            Version::Two => vec![("cpu.max", format!("{quota} {period}"))],
        };
        for (file, content) in settings.into_iter().chain([("cgroup.procs", pid.to_string())]) {
            write(&group.join(file), &content).map_err(refused)?;
        }
        Ok(())
    }

    /// Removes the groups, whose processes have ended.
    pub(super) fn clear(&mut self) {
        for group in self.groups.drain(..) {
            remove(&group);
        }
    }
}

impl Drop for Quotas {
    fn drop(&mut self) {
        self.clear();
        remove(&self.parent);
    }
}

/// (quota, period), microseconds.
fn quota(cores: f64) -> (u64, u64) {
    let period = PERIOD_US.max(QUOTA_MIN_US / cores).min(PERIOD_MAX_US);
    ((cores * period).round() as u64, period.round() as u64)
}

/// A group is busy for a moment after its last process has ended.
fn remove(group: &Path) {
    for _ in 0..100 {
        match fs::remove_dir(group) {
            Err(error) if error.kind() == io::ErrorKind::ResourceBusy => {
                std::thread::sleep(Duration::from_millis(10));
            }
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                tracing::warn!(group = %group.display(), %error, "control group not removed");
                return;
            }
            _ => return,
        }
    }
    tracing::warn!(group = %group.display(), "control group not removed: a process is in it");
}

/// Removes what killed processes of this program have left.
fn sweep(home: &Path) {
    let below = |path: &Path| {
        let entries = fs::read_dir(path).into_iter().flatten().flatten();
        entries.filter(|e| e.file_type().is_ok_and(|t| t.is_dir())).map(|e| e.path()).collect::<Vec<_>>()
    };
    for group in below(home) {
        let name = group.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let Some(pid) = name.strip_prefix(PREFIX) else { continue };
        if !Path::new("/proc").join(pid).exists() {
            below(&group).iter().for_each(|inner| remove(inner));
            remove(&group);
        }
    }
}

/// Lets the children of a version 2 group have the cpu controller.
fn hand_down(group: &Path) -> Result<(), String> {
    let path = group.join("cgroup.subtree_control");
    let has = fs::read_to_string(&path).map_err(|e| format!("cannot read {}: {e}", path.display()))?;
    if has.split_whitespace().any(|controller| controller == "cpu") { Ok(()) } else { write(&path, "+cpu") }
}

/// Groups to try to make ours in, the best first: version 1 below the own group; version 2 beside it (one with
/// processes in it cannot have children with a controller), then at the top.
fn homes(mounts: &str, own: &str) -> Vec<(Version, PathBuf)> {
    let own = |wanted: &dyn Fn(&str) -> bool| {
        let of_line = |line: &str| {
            let (controllers, path) = line.split_once(':')?.1.split_once(':')?;
            wanted(controllers).then(|| path.trim_start_matches('/').to_owned())
        };
        own.lines().find_map(of_line).unwrap_or_default()
    };
    let has_cpu = |list: &str| list.split(',').any(|c| c == "cpu");
    let mut homes = Vec::new();
    for line in mounts.lines() {
        let fields: Vec<&str> = line.split_whitespace().collect();
        let &[_, mount, kind, options, ..] = fields.as_slice() else { continue };
        let mount = Path::new(mount);
        match kind {
            "cgroup" if has_cpu(options) => {
                let group = mount.join(own(&has_cpu));
                // Inside a container the own path may be one of the host's.
                homes.push((Version::One, if group.is_dir() { group } else { mount.to_owned() }));
            }
            "cgroup2" => {
                let group = mount.join(own(&str::is_empty));
                let beside = group.parent().filter(|p| p.starts_with(mount)).unwrap_or(mount);
                homes.extend([(Version::Two, beside.to_owned()), (Version::Two, mount.to_owned())]);
            }
            _ => {}
        }
    }
    homes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quota_is_a_share_of_a_short_period_that_the_kernel_takes() {
        assert_eq!(quota(0.1), (1000, 10_000));
        assert_eq!(quota(2.0), (20_000, 10_000));
        // 1 ms is the least, so the period grows.
        assert_eq!(quota(0.02), (1000, 50_000));
    }

    #[test]
    fn both_versions_are_found_and_version_one_is_tried_first() {
        let mounts = "cgroup /nowhere/cpu,cpuacct cgroup rw,cpu,cpuacct 0 0\n\
                      cgroup /nowhere/pids cgroup rw,pids 0 0\n\
                      cgroup2 /nowhere/unified cgroup2 rw 0 0\n";
        let own = "4:pids:/a\n2:cpu,cpuacct:/b\n0::/user/session\n";
        let expected = [
            (Version::One, "/nowhere/cpu,cpuacct"),
            (Version::Two, "/nowhere/unified/user"),
            (Version::Two, "/nowhere/unified"),
        ];
        assert_eq!(homes(mounts, own), expected.map(|(v, p)| (v, PathBuf::from(p))));
        let none = Quotas::below("proc /proc proc rw 0 0\n", own, 0.1).unwrap_err().to_string();
        assert!(none.contains("no cpu controller is mounted") && none.contains("run as root"), "{none}");
    }
}
