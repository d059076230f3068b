//! The places to which one goal leads, one after the other.

use curionav_planning::geometry::Point2;
use curionav_ros2::messages::PoseStamped;

/// Where to go: a place, and a heading to arrive with.
pub(crate) type Destination = (Point2, Option<f64>);

/// So near to a pose that it only passes the robot has been through it, metres: the `radius` of Nav2's
/// `RemovePassedGoals` in its own trees.
const PASSED: f64 = 0.7;

/// What has become of one place.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum PlaceEnd {
    /// The robot has not been there yet.
    Pending,
    /// The robot was there.
    Reached,
    /// It cannot get there: Nav2's number, and the reason in words.
    Missed(u16, String),
}

/// A place of a tour.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Place {
    /// As the client has said it.
    pub(crate) pose: PoseStamped,
    /// The same in the map.
    pub(crate) destination: Destination,
    /// What has become of it, in the newest round.
    pub(crate) end: PlaceEnd,
}

/// Places, which of them the robot goes to, and how often it begins again.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Tour {
    places: Vec<Place>,
    at: usize,
    rounds_left: u32,
}

impl Tour {
    /// Through these places from number `first` on, and through all of them `rounds` times more.
    pub(crate) fn new(places: Vec<Place>, first: usize, rounds: u32) -> Self {
        Self { places, at: first, rounds_left: rounds }
    }

    /// Where the robot goes now; nothing once the tour has no place.
    pub(crate) fn destination(&self) -> Option<Destination> {
        self.places.get(self.at).map(|place| place.destination)
    }

    /// All places in their order.
    pub(crate) fn places(&self) -> &[Place] {
        &self.places
    }

    /// Which of them the robot goes to.
    pub(crate) fn at(&self) -> usize {
        self.at
    }

    /// How many places are still ahead in this round.
    pub(crate) fn remaining(&self) -> usize {
        self.places.len().saturating_sub(self.at)
    }

    /// Whether a robot that is `here` has been through the place, and may go on to the next without a stop.
    pub(crate) fn is_passed(&self, here: Point2) -> bool {
        let is_last = self.at + 1 >= self.places.len();
        !is_last && self.destination().is_some_and(|(place, _)| place.distance(here) < PASSED)
    }

    /// The place has ended so; gives where the robot goes then, if it does.
    pub(crate) fn next(&mut self, end: PlaceEnd) -> Option<Destination> {
        self.places.get_mut(self.at)?.end = end;
        if self.at + 1 < self.places.len() {
            self.at += 1;
        } else if self.rounds_left > 0 {
            self.rounds_left -= 1;
            self.at = 0;
        } else {
            return None;
        }
        self.destination()
    }

    /// Metres as the crow flies from `here` to the last place, through those between.
    pub(crate) fn distance(&self, here: Point2) -> f64 {
        let mut from = here;
        let mut metres = 0.0;
        for place in self.places.iter().skip(self.at) {
            metres += from.distance(place.destination.0);
            from = place.destination.0;
        }
        metres
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tour(rounds: u32) -> Tour {
        let places = [1.0, 2.0, 4.0].map(|x| Place {
            pose: PoseStamped::default(),
            destination: (Point2::new(x, 0.0), None),
            end: PlaceEnd::Pending,
        });
        Tour::new(places.into(), 0, rounds)
    }

    #[test]
    fn a_tour_goes_to_each_place_in_each_round() {
        let mut tour = tour(1);
        let mut seen = vec![tour.destination().unwrap().0.x];
        while let Some((place, _)) = tour.next(PlaceEnd::Reached) {
            seen.push(place.x);
        }
        assert_eq!(seen, [1.0, 2.0, 4.0, 1.0, 2.0, 4.0]);
        assert_eq!(Tour::default().destination(), None);
    }

    #[test]
    fn what_is_ahead_is_measured_through_all_places() {
        let mut tour = tour(0);
        assert_eq!((tour.distance(Point2::default()), tour.remaining()), (4.0, 3));
        tour.next(PlaceEnd::Missed(208, "no way".into()));
        assert_eq!((tour.distance(Point2::default()), tour.remaining(), tour.at()), (4.0, 2, 1));
    }

    #[test]
    fn the_last_place_is_reached_and_not_only_passed() {
        let mut tour = tour(0);
        assert!(tour.is_passed(Point2::new(0.5, 0.0)) && !tour.is_passed(Point2::new(0.0, 0.0)));
        tour.next(PlaceEnd::Reached);
        tour.next(PlaceEnd::Reached);
        assert!(!tour.is_passed(Point2::new(4.0, 0.0)));
    }
}
