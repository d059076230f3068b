//! What one range of the laser says about the pose.

use crate::parameters;

parameters! {
    /// What a range says about the pose.
    #[derive(Default)]
    #[non_exhaustive]
    pub enum MeasurementModel {
        /// Beams that end on walls: position across the wall, and heading.
        #[default]
        Beam,
        /// The paper's text (eqs. 3 and 8): distances to landmark points, here the cells that beams end
        /// on. Tells nothing about the heading by itself.
        Range,
    }
}
