//! Hosts with addresses of their own on this machine: network namespaces, joined by a bridge.

use std::path::Path;
use std::process::Command;

/// Addresses for measuring networks (RFC 2544): no other network has them.
const NETWORK: &str = "198.18";
/// This process's own address in the subnet.
const OURS: usize = 254;

/// A bridge, and hosts with one link to it each. All of it is gone once this is dropped.
pub(super) struct Network {
    /// Of the bridge; namespaces and links begin with it.
    name: String,
    subnet: String,
    hosts: Vec<String>,
}

impl Network {
    /// A bridge without hosts, on which this process has an address; or why there can be none here.
    pub(super) fn new() -> Result<Self, String> {
        remove_leftovers();
        let taken = ip(&["-4", "-oneline", "address"])?;
        let pid = std::process::id();
        let free = |n: &u32| !taken.contains(&format!("{NETWORK}.{n}.{OURS}/"));
        let number = (0..256).map(|i| (i + pid) % 256).find(free).ok_or("every subnet is taken")?;
        let network =
            Self { name: format!("cn{pid}"), subnet: format!("{NETWORK}.{number}"), hosts: Vec::new() };
        // What has been made so far is removed if a step fails.
        ip(&["link", "add", &network.name, "type", "bridge"])?;
        ip(&["address", "add", &format!("{}/24", network.ours()), "dev", &network.name])?;
        ip(&["link", "set", &network.name, "up"])?;
        let tried = network.namespace("tried");
        ip(&["netns", "add", &tried])?;
        ip(&["netns", "exec", &tried, "true"])?;
        ip(&["netns", "delete", &tried])?;
        Ok(network)
    }

    /// Adds a host and its link to the bridge.
    pub(super) fn add(&mut self, host: &str) {
        self.hosts.push(host.to_owned());
        let (namespace, link) = (self.namespace(host), self.link(host));
        must(&["netns", "add", &namespace]);
        must(&["link", "add", &link, "type", "veth", "peer", "name", "eth0", "netns", &namespace]);
        must(&["link", "set", &link, "master", &self.name, "up"]);
        let address = format!("{}/24", self.address(host));
        must(&["-n", &namespace, "address", "add", &address, "dev", "eth0"]);
        must(&["-n", &namespace, "link", "set", "eth0", "up"]);
        must(&["-n", &namespace, "link", "set", "lo", "up"]);
    }

    /// The address of a host.
    pub(super) fn address(&self, host: &str) -> String {
        format!("{}.{}", self.subnet, self.number(host))
    }

    /// The address of this process.
    pub(super) fn ours(&self) -> String {
        format!("{}.{OURS}", self.subnet)
    }

    /// A command that runs `program` on a host, under the process id it is started with.
    pub(super) fn on(&self, host: &str, program: &Path) -> Command {
        let mut command = Command::new("ip");
        command.args(["netns", "exec", &self.namespace(host)]).arg(program);
        command
    }

    /// Takes the link of a host down, or up again.
    pub(super) fn set_link(&self, host: &str, up: bool) {
        must(&["link", "set", &self.link(host), if up { "up" } else { "down" }]);
    }

    /// Loses everything `from` sends to `to`, or nothing any more. The other direction is left alone.
    pub(super) fn set_loss(&self, from: &str, to: &str, lost: bool) {
        let change = if lost { "add" } else { "delete" };
        must(&["-n", &self.namespace(from), "route", change, "blackhole", &self.address(to)]);
    }

    /// Lets through the link of a host `mbit` megabits a second each way.
    pub(super) fn throttle(&self, host: &str, mbit: u32) {
        let rate = format!("{mbit}mbit");
        let (namespace, link) = (self.namespace(host), self.link(host));
        let shape = ["root", "tbf", "rate", &rate, "burst", "32kb", "latency", "100ms"];
        let inside = [&["-n", &namespace, "qdisc", "add", "dev", "eth0"], &shape[..]].concat();
        let outside = [&["qdisc", "add", "dev", &link], &shape[..]].concat();
        for arguments in [inside, outside] {
            run("tc", &arguments).unwrap_or_else(|error| panic!("{error}"));
        }
    }

    fn number(&self, host: &str) -> usize {
        1 + self.hosts.iter().position(|h| h == host).unwrap_or_else(|| panic!("no host {host}"))
    }

    fn namespace(&self, host: &str) -> String {
        format!("{}-{host}", self.name)
    }

    /// The bridge's end of a host's link; names of links are short.
    fn link(&self, host: &str) -> String {
        format!("{}-{}", self.name, self.number(host))
    }
}

impl Drop for Network {
    fn drop(&mut self) {
        remove(&self.name);
    }
}

/// Removes what a process left behind that was killed before it could.
fn remove_leftovers() {
    let bridges = ip(&["-oneline", "link", "show", "type", "bridge"]).unwrap_or_default();
    for line in bridges.lines() {
        let name = line.split(": ").nth(1).unwrap_or_default();
        let Some(pid) = name.strip_prefix("cn").and_then(|pid| pid.parse::<u32>().ok()) else { continue };
        if !Path::new(&format!("/proc/{pid}")).exists() {
            remove(name);
        }
    }
}

/// What is not there needs no removing. A namespace lives on for as long as any process holds a socket in it, and
/// its end of a link with it, so links are removed first.
fn remove(name: &str) {
    let of_ours = format!("{name}-");
    for line in ip(&["-oneline", "link", "show", "type", "veth"]).unwrap_or_default().lines() {
        let link = line.split(": ").nth(1).and_then(|l| l.split('@').next()).unwrap_or_default();
        if link.starts_with(&of_ours) {
            let _ = ip(&["link", "delete", link]);
        }
    }
    let namespaces = ip(&["netns", "list"]).unwrap_or_default();
    for namespace in namespaces.split_whitespace().filter(|n| n.starts_with(&of_ours)) {
        for pid in ip(&["netns", "pids", namespace]).unwrap_or_default().split_whitespace() {
            let _ = run("kill", &["-KILL", pid]);
        }
        let _ = ip(&["netns", "delete", namespace]);
    }
    let _ = ip(&["link", "delete", name]);
}

fn must(arguments: &[&str]) {
    ip(arguments).unwrap_or_else(|error| panic!("{error}"));
}

fn ip(arguments: &[&str]) -> Result<String, String> {
    run("ip", arguments)
}

fn run(program: &str, arguments: &[&str]) -> Result<String, String> {
    let called = || format!("{program} {}", arguments.join(" "));
    let output = Command::new(program).args(arguments).output().map_err(|e| format!("{}: {e}", called()))?;
    if !output.status.success() {
        return Err(format!("{}: {}", called(), String::from_utf8_lossy(&output.stderr).trim()));
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}
