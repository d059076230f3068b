//! The page `docs/scenario.md`.

use curionav_crowdsim::Scenario;
use curionav_localization::LocalizerParams;
use curionav_planning::parameters::{Ranged, reference};
use curionav_planning::profile::Profile;
use curionav_tracking_people::TrackerParams;
use toml::Table;

const HEAD: &str = "\
# The scenario file

This page is made from the source by `curionav scenario reference`; a test holds it up to date.

A scenario is a TOML file that says everything that defines a run besides the planner and the seed: the map, the
robot and its sensors, the people, the clock. `curionav scenario check FILE` says what is wrong with one, with line,
field and mend. [scenarios/](../scenarios/README.md) holds the ones that come with the project.

Lengths are metres, times seconds, angles radians counter-clockwise, unless a field's name says otherwise; positions
are in the frame of the map. A field without a default must be there, unless its meaning names what \"none\" does or
says that it may be left out. Both ends belong to a range. References such as D8 or A21 are to [methods.md](methods.md).

- `[localizer]` takes the parameters of the localiser.
- `[tracker]` takes the parameters of the tracker of people.
- `[profile]` takes any field of a planner profile, which it replaces in the planner that is chosen. A profile file has
  the same fields; [curiosity.toml](../crates/planning/profiles/curiosity.toml) explains them in their context.

The three tables are at the end of this page.

## Fields

";

/// Every field of a scenario, of the parameters of localiser and tracker and of a planner profile, as Markdown: what
/// it holds, its default, its range and its meaning.
pub fn scenario_reference() -> anyhow::Result<String> {
    let scenario = Scenario::reference().map_err(|e| anyhow::anyhow!("{e}"))?;
    let localizer = reference(LocalizerParams::FIELDS, &Table::try_from(LocalizerParams::default())?);
    let tracker = reference(TrackerParams::FIELDS, &Table::try_from(TrackerParams::default())?);
    let profile = reference(Profile::FIELDS, &Table::try_from(Profile::default())?);
    Ok(format!(
        "{HEAD}{scenario}\n## The table `[localizer]`\n\n{localizer}\n## The table `[tracker]`\n\n\
         {tracker}\n## The table `[profile]`\n\n{profile}"
    ))
}
