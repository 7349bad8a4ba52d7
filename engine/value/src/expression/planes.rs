//! Numbers of the planes that the program of a formula reads.

/// The position: on the canvas in mm and from 0 to 1, then in space in mm. These are the first planes.
pub const PLACES: [&str; 7] = ["x", "y", "u", "v", "point.x", "point.y", "point.z"];

/// The number of [`PLACES`] on the canvas.
pub const ON_CANVAS: usize = 4;

/// The number of planes before those of the inputs, which have four each.
pub const FIRST_INPUT: usize = 8;

/// The meaning of a plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlaneOf {
    /// The place with this index in [`PLACES`].
    Place(usize),
    /// A channel of an input.
    Channel {
        /// Index of the input.
        input: usize,
        /// Index of the channel.
        channel: usize,
    },
}

impl PlaneOf {
    /// The meaning of a plane's number.
    pub const fn number(plane: usize) -> Self {
        match plane.checked_sub(FIRST_INPUT) {
            Some(of) => Self::Channel { input: of / 4, channel: of % 4 },
            None => Self::Place(plane),
        }
    }
}
