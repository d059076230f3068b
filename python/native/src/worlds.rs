//! Worlds that are stepped together, on all cores: what the environments of Gymnasium are made of.

use curionav_planning::geometry::Twist;
use curionav_schemas::{InjectRequest, Message, Refusal, Reject};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use rayon::prelude::*;

use crate::episode::{Episode, FACTS, Seen};
use crate::refusal::{invalid, message, refused};

/// Worlds of one kind of robot.
#[pyclass]
pub(crate) struct Worlds {
    places: Vec<Place>,
    localizes: bool,
    most_people: usize,
}

/// Where one world after the other is played.
struct Place {
    request: InjectRequest,
    episode: Option<Episode>,
}

/// What a place is to do.
struct Order {
    /// Begin anew, by this seed, instead of a step.
    seed: Option<u64>,
    command: Twist,
}

/// ranges, velocity, belief, goal, people, mask and facts, each with the world as its first axis.
type Arrays<'py> = (
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray3<f32>>,
    Bound<'py, PyArray2<i8>>,
    Bound<'py, PyArray2<f64>>,
);

#[pymethods]
impl Worlds {
    /// As many worlds as `inject_request`s; each begins with its first seed.
    #[new]
    fn new(requests: Vec<Vec<u8>>, localizes: bool, most_people: usize) -> PyResult<Self> {
        let place = |bytes: &Vec<u8>| Ok(Place { request: message("", bytes)?, episode: None });
        Ok(Self { places: requests.iter().map(place).collect::<PyResult<_>>()?, localizes, most_people })
    }

    /// Begins anew where there is a seed, steps the others by their row of `commands`, and gives what all of them see.
    fn advance<'py>(
        &mut self,
        py: Python<'py>,
        commands: PyReadonlyArray2<'py, f64>,
        seeds: Vec<Option<u64>>,
    ) -> PyResult<Arrays<'py>> {
        let rows = commands.as_array();
        if rows.shape() != [self.places.len(), 2] || seeds.len() != self.places.len() {
            let found =
                format!("has the shape {:?}; give v and omega of {} worlds", rows.shape(), self.places.len());
            return Err(invalid("commands", found));
        }
        let twists = rows.rows().into_iter().map(|row| Twist { v: row[0], omega: row[1] });
        let orders: Vec<Order> =
            seeds.into_iter().zip(twists).map(|(seed, command)| Order { seed, command }).collect();
        let seen = py.detach(|| self.advanced(&orders)).map_err(|reject| refused(&reject))?;
        self.arrays(py, &seen)
    }

    /// Begins anew where there is a seed, and gives what these see; the others stay as they are.
    fn restart<'py>(&mut self, py: Python<'py>, seeds: Vec<Option<u64>>) -> PyResult<Arrays<'py>> {
        let seen = py.detach(|| self.restarted(&seeds)).map_err(|reject| refused(&reject))?;
        self.arrays(py, &seen)
    }

    /// Bytes of the `run_result` of a world, of what has happened in it since its start.
    fn finish<'py>(&mut self, py: Python<'py>, world: usize) -> PyResult<Bound<'py, PyBytes>> {
        let result = py.detach(|| self.episode(world)?.finish()).map_err(|reject| refused(&reject))?;
        Ok(PyBytes::new(py, &result.encode()))
    }

    /// x, y and radius of everyone in a world.
    fn everyone<'py>(&mut self, py: Python<'py>, world: usize) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let everyone = self.episode(world).map_err(|reject| refused(&reject))?.everyone();
        PyArray1::from_vec(py, everyone.concat()).reshape([everyone.len(), 3])
    }
}

impl Worlds {
    fn episode(&mut self, world: usize) -> Result<&mut Episode, Reject> {
        let episode = self.places.get_mut(world).and_then(|place| place.episode.as_mut());
        episode.ok_or_else(|| Refusal::invalid("there is no such world, or it was never begun").at("world"))
    }

    fn advanced(&mut self, orders: &[Order]) -> Result<Vec<Seen>, Reject> {
        let localizes = self.localizes;
        // A process that was forked has no other threads: one world alone needs none.
        if let ([place], [order]) = (self.places.as_mut_slice(), orders) {
            return Ok(vec![place.advance(order, localizes)?]);
        }
        let places = self.places.par_iter_mut().zip(orders);
        places.map(|(place, order)| place.advance(order, localizes)).collect()
    }

    fn restarted(&mut self, seeds: &[Option<u64>]) -> Result<Vec<Seen>, Reject> {
        let localizes = self.localizes;
        let chosen = self.places.iter_mut().zip(seeds).filter_map(|(place, seed)| Some((place, (*seed)?)));
        let chosen: Vec<_> = chosen.collect();
        chosen.into_par_iter().map(|(place, seed)| place.begin(seed, localizes)?.look()).collect()
    }

    fn arrays<'py>(&self, py: Python<'py>, seen: &[Seen]) -> PyResult<Arrays<'py>> {
        let beams = seen.first().map_or(0, |one| one.ranges.len());
        if seen.iter().any(|one| one.ranges.len() != beams) {
            return Err(invalid("laser.beams", "differs between the scenarios; give them the same laser"));
        }
        let (worlds, most) = (seen.len(), self.most_people);
        let mut people = vec![0.0; worlds * most * 5];
        let mut mask = vec![0; worlds * most];
        for (world, one) in seen.iter().enumerate() {
            for (i, row) in one.people.iter().take(most).enumerate() {
                let at = world * most + i;
                people[5 * at..5 * at + 5].copy_from_slice(row);
                mask[at] = 1;
            }
        }
        Ok((
            table(py, seen.iter().flat_map(|one| one.ranges.iter().copied()), worlds, beams)?,
            table(py, seen.iter().flat_map(|one| one.velocity), worlds, 2)?,
            table(py, seen.iter().flat_map(|one| one.belief), worlds, 5)?,
            table(py, seen.iter().flat_map(|one| one.goal), worlds, 2)?,
            PyArray1::from_vec(py, people).reshape([worlds, most, 5])?,
            PyArray1::from_vec(py, mask).reshape([worlds, most])?,
            table(py, seen.iter().flat_map(|one| one.facts), worlds, FACTS)?,
        ))
    }
}

impl Place {
    fn advance(&mut self, order: &Order, localizes: bool) -> Result<Seen, Reject> {
        if let Some(seed) = order.seed {
            return self.begin(seed, localizes)?.look();
        }
        let never = || Refusal::invalid("a world was never begun; give it a seed").at("seeds");
        let episode = self.episode.as_mut().ok_or_else(never)?;
        episode.step(order.command);
        episode.look()
    }

    fn begin(&mut self, seed: u64, localizes: bool) -> Result<&mut Episode, Reject> {
        self.request.seed = Some(seed);
        Ok(self.episode.insert(Episode::begin(&self.request, localizes)?))
    }
}

fn table<'py, T: numpy::Element>(
    py: Python<'py>,
    values: impl Iterator<Item = T>,
    rows: usize,
    columns: usize,
) -> PyResult<Bound<'py, PyArray2<T>>> {
    PyArray1::from_vec(py, values.collect()).reshape([rows, columns])
}
