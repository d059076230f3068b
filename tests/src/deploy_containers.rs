//! The image and the compose file, run with Podman where it is installed.
//!
//! No base image is pulled: the program's own libraries are the runtime image, and the compiler's place is taken
//! by a script that hands over the program built already. Everything else of `deploy/Dockerfile` is executed.

use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use curionav_testing::skip;

use crate::end_to_end::program::{comes_true, curionav, program, root, run, turn};

const TOOLS: [&str; 3] = ["podman", "podman-compose", "runc"];
/// What the stand-in for the build image needs to run a line of shell.
const BUILD_TOOLS: [&str; 4] = ["sh", "cp", "mkdir", "chmod"];

fn is_there(tool: &str) -> bool {
    Command::new(tool).arg("--version").output().is_ok_and(|o| o.status.success())
}

/// Podman with images, containers and settings in a folder of its own; all gone when dropped.
struct Podman {
    folder: tempfile::TempDir,
    port: u16,
}

impl Podman {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name).display().to_string();
        let storage = format!(
            "[storage]\ndriver = \"overlay\"\ngraphroot = \"{}\"\nrunroot = \"{}\"\n",
            path("images"),
            path("run")
        );
        // Limits that a container of this test's own may not raise.
        let containers = "[containers]\ndefault_ulimits = [\"nofile=1024:1024\", \"nproc=1024:1024\"]\n\
             [engine]\nruntime = \"runc\"\n[network]\nnetwork_backend = \"netavark\"\n";
        std::fs::write(path("storage.conf"), storage).unwrap();
        std::fs::write(path("containers.conf"), containers).unwrap();
        let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        Self { folder, port }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn command(&self, tool: &str, arguments: &[&str]) -> Output {
        Command::new(tool)
            .args(arguments)
            .current_dir(root())
            .env("CONTAINERS_CONF", self.path("containers.conf"))
            .env("CONTAINERS_STORAGE_CONF", self.path("storage.conf"))
            .env("CURIONAV_IMAGE", "localhost/curionav:tested")
            .env("CURIONAV_PORT", self.port.to_string())
            .env("CURIONAV_PKI", self.path("pki"))
            // The owner of the keys.
            .env("CURIONAV_USER", "0:0")
            .output()
            .unwrap()
    }

    fn expect(&self, tool: &str, arguments: &[&str]) -> String {
        let output = self.command(tool, arguments);
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{tool} {arguments:?}: {error}");
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    fn compose(&self, arguments: &[&str]) -> String {
        let project = self.project();
        self.expect("podman-compose", &[&["-p", &project, "-f", "deploy/compose.yaml"], arguments].concat())
    }

    /// Networks belong to the whole machine: another run of this test has its own.
    fn project(&self) -> String {
        format!("curionav-tested-{}", self.port)
    }

    /// An image of `files`, each where it is on this machine or where it is said to be.
    fn image(&self, name: &str, files: &[(PathBuf, PathBuf)]) {
        let context = self.path(name);
        for (from, to) in files {
            let to = context.join("root").join(to.strip_prefix("/").unwrap());
            std::fs::create_dir_all(to.parent().unwrap()).unwrap();
            std::fs::copy(from, to).unwrap_or_else(|e| panic!("{}: {e}", from.display()));
        }
        std::fs::write(context.join("Dockerfile"), "FROM scratch\nCOPY root/ /\n").unwrap();
        let context = context.display().to_string();
        self.expect("podman", &["build", "-q", "-t", &format!("localhost/{name}"), &context]);
    }
}

impl Drop for Podman {
    fn drop(&mut self) {
        // Whatever has failed: no container, network or mount stays.
        let (project, network) = (self.project(), format!("{}_curionav", self.project()));
        let down = ["-p", &project, "-f", "deploy/compose.yaml", "down", "-t", "1"];
        self.command("podman-compose", &down);
        self.command("podman", &["rm", "-fa", "-t", "0"]);
        self.command("podman", &["network", "rm", "-f", &network]);
        self.command("podman", &["rmi", "-fa"]);
        // What is still mounted would keep the folder.
        self.command("umount", &[&self.path("images/overlay").display().to_string()]);
    }
}

/// A program and the libraries it is linked with, as (where they are, where they shall be).
fn with_libraries(program: &Path, to: &str) -> Vec<(PathBuf, PathBuf)> {
    let output = Command::new("ldd").arg(program).output().unwrap();
    let listed = String::from_utf8(output.stdout).unwrap();
    let libraries = listed.split_whitespace().filter(|w| w.starts_with('/')).map(PathBuf::from);
    let same = libraries.map(|l| (l.clone(), l));
    std::iter::once((program.to_owned(), PathBuf::from(to))).chain(same).collect()
}

fn find(tool: &str) -> PathBuf {
    ["/bin", "/usr/bin"].iter().map(|d| Path::new(d).join(tool)).find(|p| p.is_file()).unwrap()
}

#[test]
fn the_compose_file_brings_up_a_deployment_that_drives() {
    if let Some(missing) = TOOLS.iter().find(|tool| !is_there(tool)) {
        skip(&format!("{missing} is not installed, so the compose file is only read"));
        return;
    }
    let _turn = turn();
    let podman = Podman::new();
    // The libraries are the runtime's; the program itself comes from the build.
    let libraries: Vec<_> = with_libraries(&program(), "/unused").into_iter().skip(1).collect();
    podman.image("runtime", &libraries);
    let mut build: Vec<_> =
        BUILD_TOOLS.iter().flat_map(|tool| with_libraries(&find(tool), &format!("/bin/{tool}"))).collect();
    build.push((program(), "/built/curionav".into()));
    let compiler = podman.path("cargo");
    let script = "#!/bin/sh\n# Hands over what is built already; the context must be a project.\n\
         test -f Cargo.lock && test -d services && mkdir -p target/deploy && cp /built/curionav target/deploy/\n";
    std::fs::write(&compiler, script).unwrap();
    Command::new("chmod").arg("755").arg(&compiler).status().unwrap();
    build.push((compiler, "/bin/cargo".into()));
    podman.image("build", &build);
    podman.expect(
        "podman",
        &[
            "build",
            "-q",
            "-t",
            "localhost/curionav:tested",
            "-f",
            "deploy/Dockerfile",
            "--ignorefile",
            "deploy/Dockerfile.dockerignore",
            "--build-arg",
            "BUILD_IMAGE=localhost/build",
            "--build-arg",
            "RUNTIME_IMAGE=localhost/runtime",
            ".",
        ],
    );

    // What the file's first lines say.
    let text = std::fs::read_to_string(root().join("deploy/compose.yaml")).unwrap();
    let pki = podman.path("pki").display().to_string();
    for line in text.lines().filter_map(|line| line.strip_prefix("#   curionav secure ")) {
        let line = line.replace("deploy/pki", &pki);
        let words: Vec<&str> = std::iter::once("secure").chain(line.split(' ')).collect();
        assert!(curionav(&words).status.success(), "{line}");
    }
    podman.compose(&["up", "-d", "--no-build"]);
    let endpoint = format!("tls/127.0.0.1:{}", podman.port);
    let at = ["--connect", &endpoint, "--secure", &pki];
    let examine = || curionav(&[&["doctor", "--listen", "0.1"], &at[..]].concat());
    let well = || examine().status.success();
    let words = || {
        let output = examine();
        let running = podman.command("podman", &["ps", "-a"]);
        format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&running.stdout))
    };
    assert!(comes_true(well), "{}", words());
    let (json, status) = run("scenarios/quickstart.toml", &at);
    assert_eq!((json.cycles.degraded, status), (0, 0), "{json:?}");
}
