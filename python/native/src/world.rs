//! A simulated world that Python drives tick by tick.

use curionav_crowdsim::Truth;
use curionav_in_process::prepare;
use curionav_in_process::sensed::{Sensed, sense};
use curionav_planning::geometry::{Pose2, Twist};
use curionav_planning::scene::People;
use curionav_schemas::{InjectRequest, Message, MissionOrder, encode};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::fields::FIELDS;
use crate::refusal::{message, refused};

/// What the sensors say at one tick, and what really is.
#[pyclass(frozen, get_all)]
pub(crate) struct Observation {
    /// Ticks since the start.
    tick: u64,
    /// Robot's clock, seconds.
    stamp: f64,
    /// float32 of shape (beams,): metres, in order of rising bearing.
    ranges: Py<PyArray1<f32>>,
    /// x, y and heading in the odometry frame, metres and radians.
    odometry: (f64, f64, f64),
    /// Measured speed and turn rate, m/s and rad/s.
    twist: (f64, f64),
    /// uint32 of shape (people,).
    people_id: Py<PyArray1<u32>>,
    /// float64 of shape (people, 4): x, y, vx and vy, map frame.
    people: Py<PyArray2<f64>>,
    /// Radius of a person, metres.
    person_radius: f64,
    /// x, y and heading where the robot really is, map frame.
    true_pose: (f64, f64, f64),
    /// Its true speed and turn rate.
    true_twist: (f64, f64),
    /// From its edge to that of the nearest person, metres; infinite without people.
    person_clearance: f64,
    /// From its edge to the nearest wall, metres.
    wall_clearance: f64,
    /// Whether it touches a person or has hit a wall in this tick.
    collides: bool,
}

/// Rows of x, y, vx and vy.
fn rows(people: &People) -> Vec<f64> {
    (0..people.len()).flat_map(|i| [people.x[i], people.y[i], people.vx[i], people.vy[i]]).collect()
}

fn triple(pose: Pose2) -> (f64, f64, f64) {
    (pose.x, pose.y, pose.heading)
}

/// What one tick shows, before it is Python's.
struct Shown {
    observation: curionav_crowdsim::Observation,
    truth: Truth,
}

impl Shown {
    fn of(world: &curionav_crowdsim::World) -> Self {
        Self { observation: world.observe(), truth: world.truth() }
    }

    fn into_python(self, py: Python<'_>) -> PyResult<Observation> {
        let Self { observation, truth } = self;
        let people = observation.people;
        let table = PyArray1::from_vec(py, rows(&people));
        let table = numpy::PyArrayMethods::reshape(&table, [people.len(), 4])?;
        Ok(Observation {
            tick: observation.tick,
            stamp: observation.stamp,
            ranges: PyArray1::from_vec(py, observation.ranges).unbind(),
            odometry: triple(observation.odometry),
            twist: (observation.twist.v, observation.twist.omega),
            people_id: PyArray1::from_vec(py, people.id).unbind(),
            people: table.unbind(),
            person_radius: people.radius,
            true_pose: triple(truth.pose),
            true_twist: (truth.twist.v, truth.twist.omega),
            person_clearance: truth.person_clearance,
            wall_clearance: truth.wall_clearance,
            collides: !truth.touching.is_empty() || truth.wall_impact.is_some(),
        })
    }
}

/// Odometry, scan and people as bytes.
type Senses<'py> = (Bound<'py, PyBytes>, Bound<'py, PyBytes>, Option<Bound<'py, PyBytes>>);

/// The simulated world of a scenario, without a planner.
#[pyclass]
pub(crate) struct World {
    request: InjectRequest,
    start: curionav_crowdsim::World,
    now: curionav_crowdsim::World,
    order: MissionOrder,
    map: Vec<u8>,
}

fn prepared(request: &InjectRequest) -> PyResult<(curionav_crowdsim::World, MissionOrder, Vec<u8>)> {
    let prepared = prepare(request, "robot", &FIELDS).map_err(|reject| refused(&reject))?;
    Ok((prepared.world, prepared.order, prepared.map.encode()))
}

#[pymethods]
impl World {
    /// The world of an `inject_request` at its start.
    #[new]
    fn new(py: Python<'_>, request: &[u8]) -> PyResult<Self> {
        let request: InjectRequest = message("", request)?;
        let (start, order, map) = py.detach(|| prepared(&request))?;
        Ok(Self { request, now: start.clone(), start, order, map })
    }

    /// Back to the start, by another seed if one is given.
    #[pyo3(signature = (seed=None))]
    fn reset(&mut self, py: Python<'_>, seed: Option<u64>) -> PyResult<Observation> {
        let shown = py.detach(|| {
            if seed.is_some() && seed != self.request.seed {
                self.request.seed = seed;
                (self.start, self.order, _) = prepared(&self.request)?;
            }
            self.now = self.start.clone();
            PyResult::Ok(Shown::of(&self.now))
        });
        shown?.into_python(py)
    }

    /// One tick, in which the base is told to drive so.
    fn step(&mut self, py: Python<'_>, v: f64, omega: f64) -> PyResult<Observation> {
        let shown = py.detach(|| {
            self.now.step(Twist { v, omega });
            Shown::of(&self.now)
        });
        shown.into_python(py)
    }

    /// Bytes of the messages `odometry`, `scan` and `people` of this tick; of people none if a tracker is to find them.
    fn sense<'py>(&self, py: Python<'py>) -> PyResult<Senses<'py>> {
        let Sensed { scan, odometry, people } = sense(&self.now).map_err(|reject| refused(&reject))?;
        let bytes = |encoded: Vec<u8>| PyBytes::new(py, &encoded);
        Ok((bytes(odometry.encode()), bytes(scan.encode()), people.map(|people| bytes(people.encode()))))
    }

    /// Bytes of the `mission_order` that a robot is given in it.
    #[getter]
    fn order<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &encode(&self.order))
    }

    /// Bytes of the `occupancy_grid` that the robot is given.
    #[getter]
    fn map<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.map)
    }

    /// Seconds after which the run is over.
    #[getter]
    fn time_limit(&self) -> f64 {
        self.now.scenario().clock.time_limit_s
    }
}
