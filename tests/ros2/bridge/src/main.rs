//! A Zenoh router that carries what ROS 2 nodes on DDS say, for the tests of the gateway's dialect `ros2dds`.
//!
//! `curionav-ros2-bridge CONFIG`: a Zenoh configuration file (JSON5) with a `plugins.ros2dds` table. When the router
//! listens, it prints its addresses as one line of JSON; it ends when its standard input does.

use std::io::Read;

use zenoh::Config;
use zenoh::internal::plugins::PluginsManager;
use zenoh::internal::runtime::RuntimeBuilder;
use zenoh_plugin_ros2dds::ROS2Plugin;

#[tokio::main]
async fn main() -> Result<(), zenoh::Error> {
    zenoh::try_init_log_from_env();
    let file = std::env::args().nth(1).ok_or("usage: curionav-ros2-bridge CONFIG")?;
    let mut plugins = PluginsManager::static_plugins_only();
    plugins.declare_static_plugin::<ROS2Plugin, _>("ros2dds", true);
    let mut runtime = RuntimeBuilder::new(Config::from_file(file)?).plugins_manager(plugins).build().await?;
    runtime.start().await?;
    let listening: Vec<String> =
        runtime.get_locators().iter().map(|locator| format!("{:?}", locator.as_str())).collect();
    println!("{{\"listening\":[{}]}}", listening.join(","));
    // The tests hold the other end: the bridge ends with them, however they end.
    tokio::task::spawn_blocking(|| std::io::stdin().read_to_end(&mut Vec::new())).await??;
    Ok(())
}
