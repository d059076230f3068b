//! Drawings for rviz and Foxglove.

use super::geometry::{Duration, Header, Point, Pose, Vector3};
use crate::interface::Interface;
use crate::limits::{MARKER_BYTES, MARKERS, POINTS};

message! {
    /// A colour; each part from 0 to 1.
    #[derive(Copy)]
    ColorRgba;
    {
        /// Red.
        r: f32,
        /// Green.
        g: f32,
        /// Blue.
        b: f32,
        /// 0 is not seen, 1 hides what is behind.
        a: f32,
    }
}

message! {
    /// A place in a texture.
    #[derive(Copy)]
    UvCoordinate;
    {
        /// To the right.
        u: f32,
        /// Down.
        v: f32,
    }
}

message! {
    /// A picture in a file format.
    CompressedImage;
    {
        /// When, and in which frame.
        header: Header,
        /// Name of the format.
        format: String,
        /// The file.
        data: Vec<u8> [MARKER_BYTES],
    }
}

message! {
    /// A mesh in a file format.
    MeshFile;
    {
        /// Name of the file.
        filename: String,
        /// The file.
        data: Vec<u8> [MARKER_BYTES],
    }
}

message! {
    /// Something to draw.
    Marker;
    {
        /// When, and in which frame.
        header: Header,
        /// With `id` it names the marker.
        ns: String,
        /// With `ns` it names the marker.
        id: i32,
        /// What it is: 2 a sphere, 3 a cylinder, 4 a line, 5 a list of lines.
        r#type: i32,
        /// 0 add or change it, 2 delete it, 3 delete all.
        action: i32,
        /// Where it is.
        pose: Pose,
        /// How large it is, m; of lines x is the width.
        scale: Vector3,
        /// Of all of it.
        color: ColorRgba,
        /// Until it vanishes; 0 is for ever.
        lifetime: Duration,
        /// Whether it moves with its frame.
        frame_locked: bool,
        /// Of lines and lists.
        points: Vec<Point> [POINTS],
        /// Of each point, or none.
        colors: Vec<ColorRgba> [POINTS],
        /// Where a texture is.
        texture_resource: String,
        /// A texture.
        texture: CompressedImage,
        /// Where in the texture each point is.
        uv_coordinates: Vec<UvCoordinate> [POINTS],
        /// To be written.
        text: String,
        /// Where a mesh is.
        mesh_resource: String,
        /// A mesh.
        mesh_file: MeshFile,
        /// Whether the mesh has its own colours.
        mesh_use_embedded_materials: bool,
    }
}

message! {
    /// Several things to draw.
    MarkerArray = "visualization_msgs/msg/MarkerArray" of Interface::new(
        "visualization_msgs/msg/MarkerArray",
        "RIHS01_86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf",
    ), at most 16 << 20;
    {
        /// Drawn in this order.
        markers: Vec<Marker> [MARKERS],
    }
}
