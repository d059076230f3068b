//! Fields of a map that evaluators and generators look up instead of computing, kept by what they
//! depend on. The services of one process share them.

use std::sync::Arc;

use curionav_planning::evaluation::cpc::{InformationField, InformationParams, RayField};
use curionav_planning::evaluation::information_to_go::InformationToGoField;
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::occupancy::{CoarseFloor, GeodesicField, Obstacles, OccupancyGrid, StaticMap, Way};
use curionav_planning::sensor::LaserModel;
use curionav_planning::terms::{DerivedFields, InformationToGoTermParams, Task};
use curionav_schemas::{MapId, Prepared, Refusal, Reject};

use crate::cores::Cores;
use crate::map_store::{MapSource, MapStore};
use crate::single_flight_cache::SingleFlightCache;
use crate::timed::timed;

/// Bytes of distance fields kept, and as many of what uncertainty costs on the ways: a robot has one goal at a time. On
/// a map of 350 000 cells a distance field is 1.4 MB, so these are the fields of 90 goals.
const GEODESIC_BYTES: usize = 128 << 20;
/// Bytes of information fields kept, and as many of their rays: robots of one kind on one map share one. On that map a
/// field is at most 13 MB, and its rays are 19 MB.
const INFORMATION_BYTES: usize = 128 << 20;

/// Bytes of maps with obstacles on them, and of the ways past these: of the newest of a few robots.
const OBSTRUCTED_BYTES: usize = 16 << 20;

/// How far from the robot distances to obstacles are exact, metres along either axis of the map: beyond what it looks
/// ahead. Farther away they are in the way to the goal alone.
const NEAR: f64 = 8.0;

struct Stock {
    maps: MapStore,
    /// By map, and the way that a robot is to keep to.
    along: SingleFlightCache<(MapId, u64), StaticMap>,
    /// By map, that way, and what stands there that the map does not have.
    obstructed: SingleFlightCache<(MapId, u64, Obstacles), StaticMap>,
    /// By map, the way, and the room that a robot keeps.
    floors: SingleFlightCache<(MapId, [u64; 2]), CoarseFloor>,
    /// By map, what stands on it that it does not have, all of it and what is near, goal, room and the way.
    past: SingleFlightCache<(MapId, [Obstacles; 2], [u64; 4]), GeodesicField>,
    /// By map, goal, room and the way.
    geodesic: SingleFlightCache<(MapId, [u64; 4]), GeodesicField>,
    /// By map, what shapes the fan of rays, and parameters.
    information: SingleFlightCache<(MapId, LaserModel, InformationParams), InformationField>,
    rays: SingleFlightCache<(MapId, LaserModel, InformationParams), RayField>,
    information_to_go: SingleFlightCache<(MapId, u64, Task, InformationToGoTermParams), InformationToGoField>,
}

/// Maps and everything derived from them. Clones share what is kept.
#[derive(Clone)]
pub struct Fields {
    stock: Arc<Stock>,
    derives: bool,
}

impl Fields {
    /// Nothing is kept yet; maps come from `source`.
    pub fn new(source: Box<dyn MapSource>) -> Self {
        Self::keeping(MapStore::new(source))
    }

    /// Fields of maps that are here already; none is fetched.
    pub fn of_maps(maps: impl IntoIterator<Item = StaticMap>) -> Self {
        Self::keeping(MapStore::holding(maps))
    }

    /// Fields of maps that are here already, with room for so many bytes of ways to goals.
    pub fn of_maps_within(maps: impl IntoIterator<Item = StaticMap>, geodesic_bytes: usize) -> Self {
        Self::within(MapStore::holding(maps), geodesic_bytes)
    }

    fn keeping(maps: MapStore) -> Self {
        Self::within(maps, GEODESIC_BYTES)
    }

    fn within(maps: MapStore, geodesic_bytes: usize) -> Self {
        let stock = Stock {
            maps,
            along: SingleFlightCache::new(OBSTRUCTED_BYTES, StaticMap::bytes),
            obstructed: SingleFlightCache::new(OBSTRUCTED_BYTES, StaticMap::bytes),
            floors: SingleFlightCache::new(OBSTRUCTED_BYTES, CoarseFloor::bytes),
            past: SingleFlightCache::new(OBSTRUCTED_BYTES, GeodesicField::bytes),
            geodesic: SingleFlightCache::new(geodesic_bytes, GeodesicField::bytes),
            information: SingleFlightCache::new(INFORMATION_BYTES, InformationField::bytes),
            rays: SingleFlightCache::new(INFORMATION_BYTES, RayField::bytes),
            information_to_go: SingleFlightCache::new(geodesic_bytes, InformationToGoField::bytes),
        };
        Self { stock: Arc::new(stock), derives: true }
    }

    /// The same fields for work that cannot wait: what is not kept is refused as [`Refusal::Cold`].
    pub fn kept(&self) -> Self {
        Self { stock: Arc::clone(&self.stock), derives: false }
    }

    /// The map of a grid that needs not be fetched.
    pub fn insert(&self, grid: OccupancyGrid) -> Arc<StaticMap> {
        self.stock.maps.insert(grid)
    }

    /// The map itself with its distance fields. Blocks while it is fetched or derived, as do the others.
    pub fn map(&self, id: MapId) -> Result<Arc<StaticMap>, Reject> {
        if self.derives {
            return self.stock.maps.get(id);
        }
        self.stock.maps.kept(id).ok_or_else(|| cold("the map"))
    }

    /// The fields of one map.
    pub fn of(&self, map: MapId) -> FieldsOf<'_> {
        let none = Obstacles::default();
        FieldsOf { fields: self, map, way: None, near: none.clone(), obstacles: none }
    }

    /// Distances to `goal` on `map` for a robot that keeps `room` metres from walls.
    pub fn way(&self, map: &StaticMap, goal: Point2, room: f64) -> Result<Arc<GeodesicField>, Reject> {
        let [x, y, keeps] = [goal.x, goal.y, room].map(f64::to_bits);
        let key = (MapId(map.grid.hash()), [x, y, keeps, map.way()]);
        self.derived("the way to this goal", &self.stock.geodesic, &key, || {
            GeodesicField::new(map, goal, room)
        })
    }

    /// What is kept.
    pub fn prepared(&self) -> Vec<Prepared> {
        let maps = self.stock.maps.ids().into_iter().map(|map| Prepared::Map { map });
        let goals = self.stock.geodesic.keys().into_iter().map(|(map, [x, y, ..])| Prepared::Goal {
            map,
            x: f64::from_bits(x),
            y: f64::from_bits(y),
        });
        let sensors = self.stock.information.keys().into_iter().map(|(map, laser, _)| {
            let LaserModel { beams, fov, range_max, .. } = laser;
            Prepared::Sensor { map, beams, fov, range_max }
        });
        maps.chain(goals).chain(sensors).collect()
    }

    fn derived<K: PartialEq + Clone, V>(
        &self,
        what: &str,
        kept: &SingleFlightCache<K, V>,
        key: &K,
        derive: impl FnOnce() -> V,
    ) -> Result<Arc<V>, Reject> {
        if self.derives {
            return kept.get_or_try(key, || Ok(timed(what, derive)));
        }
        kept.get(key).ok_or_else(|| cold(what))
    }
}

/// The fields of one map, each derived once.
pub struct FieldsOf<'a> {
    fields: &'a Fields,
    map: MapId,
    /// What the robot is to keep to.
    way: Option<Arc<Way>>,
    obstacles: Obstacles,
    /// Those of them that are near the robot.
    near: Obstacles,
}

impl FieldsOf<'_> {
    /// The same for a robot that is to keep to a way, if there is one.
    #[must_use]
    pub fn along(self, way: Option<Arc<Way>>) -> Self {
        Self { way, ..self }
    }

    /// The same with these obstacles, for a robot that is `here`. What a laser sees stays that of the map.
    ///
    /// # Errors
    /// If the map is not there.
    pub fn obstructed(self, obstacles: &Obstacles, here: Point2) -> Result<Self, Reject> {
        if obstacles.is_empty() {
            return Ok(self);
        }
        let near = obstacles.near(&self.mapped()?.grid, here, NEAR);
        Ok(Self { obstacles: obstacles.clone(), near, ..self })
    }

    /// The map without obstacles.
    fn mapped(&self) -> Result<Arc<StaticMap>, Reject> {
        let map = self.fields.map(self.map)?;
        match &self.way {
            Some(way) => {
                let along = &self.fields.stock.along;
                along.get_or_try(&(self.map, way.id()), || Ok(map.along(way)))
            }
            None => Ok(map),
        }
    }

    fn floor(&self, map: &StaticMap, room: f64) -> Result<Arc<CoarseFloor>, Reject> {
        let floors = &self.fields.stock.floors;
        floors.get_or_try(&(self.map, [room.to_bits(), map.way()]), || Ok(CoarseFloor::new(map, room)))
    }

    /// The way past obstacles. These change: also work that cannot wait derives it, which takes little time.
    fn past(&self, map: &StaticMap, goal: Point2, room: f64) -> Result<Arc<GeodesicField>, Reject> {
        let floor = self.floor(map, room)?;
        let obstructed = self.map()?;
        let obstacles = [&self.obstacles, &self.near].map(Clone::clone);
        let [x, y, keeps] = [goal.x, goal.y, room].map(f64::to_bits);
        let key = (self.map, obstacles, [x, y, keeps, map.way()]);
        let past = &self.fields.stock.past;
        past.get_or_try(&key, || Ok(floor.past(map, &obstructed, &self.obstacles, goal)))
    }
}

impl DerivedFields for FieldsOf<'_> {
    type Error = Reject;

    fn obstacles(&self) -> Obstacles {
        self.obstacles.clone()
    }

    fn map(&self) -> Result<Arc<StaticMap>, Reject> {
        let map = self.mapped()?;
        if self.near.is_empty() {
            return Ok(map);
        }
        let key = (self.map, map.way(), self.near.clone());
        self.fields.stock.obstructed.get_or_try(&key, || Ok(map.with_obstacles(&self.near)))
    }

    fn geodesic(&self, goal: Point2, radius: f64) -> Result<Arc<GeodesicField>, Reject> {
        let map = self.mapped()?;
        let room = radius + GeodesicField::PLANNING_MARGIN;
        if !self.obstacles.is_empty() {
            return self.past(&map, goal, room);
        }
        if self.fields.derives {
            // A robot that meets an obstacle finds it ready.
            self.floor(&map, room)?;
        }
        self.fields.way(&map, goal, room)
    }

    fn information(
        &self,
        laser: LaserModel,
        params: &InformationParams,
    ) -> Result<Arc<InformationField>, Reject> {
        let map = self.mapped()?;
        let fan = fan(laser);
        let key = (self.map, fan, *params);
        let stock = &self.fields.stock.information;
        let field = self.fields.derived("what this sensor sees", stock, &key, || {
            InformationField::by(&Cores::all(), &map, &fan, params)
        })?;
        Ok(if laser.robot_from_laser == Pose2::default() {
            field
        } else {
            Arc::new(field.mounted(laser.robot_from_laser))
        })
    }

    fn rays(&self, laser: LaserModel, params: &InformationParams) -> Result<Arc<RayField>, Reject> {
        let map = self.mapped()?;
        let fan = fan(laser);
        let information = self.information(fan, params)?;
        let key = (self.map, fan, *params);
        self.fields.derived("each ray of this sensor", &self.fields.stock.rays, &key, || {
            RayField::by(&Cores::all(), &information, &map, &fan, params)
        })
    }

    fn information_to_go(
        &self,
        task: &Task,
        params: &InformationToGoTermParams,
    ) -> Result<Arc<InformationToGoField>, Reject> {
        let map = self.mapped()?;
        let seen = self.information(task.laser, &params.prediction.information)?;
        let key = (self.map, map.way(), task.clone(), *params);
        self.fields.derived(
            "what uncertainty costs on this way",
            &self.fields.stock.information_to_go,
            &key,
            || params.field(&map, &seen, task),
        )
    }
}

/// What shapes the fan of a laser's rays: where it sits, and how exact it is, change nothing of what they meet.
fn fan(laser: LaserModel) -> LaserModel {
    LaserModel { robot_from_laser: Pose2::default(), range_sigma: 0.0, ..laser }
}

fn cold(what: &str) -> Reject {
    Refusal::Cold { detail: what.to_owned() }.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn robots_whose_lasers_differ_only_in_their_place_share_what_these_see() {
        let cells = (0..400).map(|i| if i % 20 == 0 { 100 } else { 0 }).collect();
        let grid = OccupancyGrid::new(20, 20, 0.2, Pose2::default(), cells).unwrap();
        let id = MapId(grid.hash());
        let map = StaticMap::new(grid);
        let fields = Fields::of_maps([map.clone()]);
        let centred = LaserModel::default();
        let params = InformationParams::default();
        let ahead = LaserModel { robot_from_laser: Pose2::new(0.2, 0.1, 0.3), range_sigma: 0.01, ..centred };
        for laser in [centred, ahead] {
            let shared = fields.of(id).information(laser, &params).unwrap();
            let own = InformationField::new(&map, &laser, &params);
            for pose in [Pose2::new(0.5, 1.0, 0.4), Pose2::new(1.5, 2.0, -2.0)] {
                assert_eq!(shared.at(pose), own.at(pose), "{laser:?}");
            }
            assert!(shared.at(Pose2::new(0.5, 1.0, 0.4)).norm() > 0.0, "it sees nothing");
        }
        assert_eq!(fields.stock.information.keys().len(), 1);
        let nearer = LaserModel { range_max: 2.0, ..centred };
        fields.of(id).information(nearer, &params).unwrap();
        assert_eq!(fields.stock.information.keys().len(), 2);
    }
}
