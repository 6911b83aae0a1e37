//! Triangle meshes in the form of their files.

/// A triangle mesh in a space of its own. Checked: every index refers to a vertex, and every number is finite.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// The vertices.
    pub positions: Vec<[f32; 3]>,
    /// Shading normals, one per vertex, of any length; or none.
    pub normals: Vec<[f32; 3]>,
    /// uv, one per vertex. Without any, each triangle has (0, 0), (1, 0) and (1, 1) at its corners.
    pub uv: Vec<[f32; 2]>,
    /// The second set of uv, one per vertex; or none.
    pub second_uv: Vec<[f32; 2]>,
    /// The corners of the triangles as indices of vertices, counter-clockwise from outside; at least one triangle.
    pub triangles: Vec<[u32; 3]>,
}

/// The largest magnitude of a coordinate: its squares and areas can be represented in 32 bits.
pub const FARTHEST: f32 = 1e18;

/// The maximum number of triangles, and of vertices: their indices have 31 bits.
pub const MOST: usize = 1 << 30;

/// An invalid mesh.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MeshError {
    /// It has no triangle.
    #[error("there is no triangle in it")]
    Empty,
    /// It has triangles, but all of them are degenerate.
    #[error("all of its triangles have zero area")]
    Flat,
    /// It has more vertices or triangles than can be numbered.
    #[error("it has {0} vertices or triangles, more than stride can number (2³⁰)")]
    TooMany(usize),
    /// A corner refers to a vertex that does not exist.
    #[error("triangle {triangle} has vertex {index}, but there are only {vertices} (counted from 0)")]
    NoSuchVertex {
        /// The index of the triangle, from 0.
        triangle: usize,
        /// The index of the corner's vertex.
        index: u32,
        /// The number of vertices.
        vertices: usize,
    },
    /// A number that is NaN, infinite or too large.
    #[error("vertex {0} (counted from 0) has a {1} that is not a number, or larger than 10¹⁸")]
    NotFinite(usize, &'static str),
}

impl Mesh {
    /// Whether any of the triangles has an area above zero.
    pub fn has_area(&self) -> bool {
        let wide = |&i: &u32| glam::DVec3::from(self.positions[i as usize].map(f64::from));
        self.triangles.iter().any(|corners| {
            let [a, b, c] = [&corners[0], &corners[1], &corners[2]].map(wide);
            (b - a).cross(c - a) != glam::DVec3::ZERO
        })
    }

    /// Checks a mesh, apart from its area: see [`Mesh::has_area`].
    pub fn check(&self) -> Result<(), MeshError> {
        let vertices = self.positions.len();
        debug_assert!(self.normals.is_empty() || self.normals.len() == vertices);
        debug_assert!([&self.uv, &self.second_uv].iter().all(|uv| uv.is_empty() || uv.len() == vertices));
        if self.triangles.is_empty() {
            return Err(MeshError::Empty);
        }
        let most = vertices.max(self.triangles.len());
        if most > MOST {
            return Err(MeshError::TooMany(most));
        }
        let fits = |numbers: &[f32]| numbers.iter().all(|x| x.abs() <= FARTHEST);
        if let Some(i) = self.positions.iter().position(|p| !fits(p)) {
            return Err(MeshError::NotFinite(i, "position"));
        }
        if let Some(i) = self.normals.iter().position(|n| !fits(n)) {
            return Err(MeshError::NotFinite(i, "normal"));
        }
        for uv in [&self.uv, &self.second_uv] {
            if let Some(i) = uv.iter().position(|uv| !fits(uv)) {
                return Err(MeshError::NotFinite(i, "uv"));
            }
        }
        for (triangle, corners) in self.triangles.iter().enumerate() {
            if let Some(&index) = corners.iter().find(|&&index| index as usize >= vertices) {
                return Err(MeshError::NoSuchVertex { triangle, index, vertices });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invalid_meshes_are_refused() {
        let good = Mesh {
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        assert_eq!(good.check(), Ok(()));
        assert!(good.has_area());
        assert!(!Mesh { triangles: vec![[0, 1, 1], [2, 2, 2]], ..good.clone() }.has_area());
        assert_eq!(Mesh::default().check(), Err(MeshError::Empty));
        let outside = Mesh { triangles: vec![[0, 1, 2], [2, 3, 1]], ..good.clone() };
        assert_eq!(outside.check(), Err(MeshError::NoSuchVertex { triangle: 1, index: 3, vertices: 3 }));
        for bad in [f32::NAN, f32::INFINITY, 1e19] {
            let mut mesh = good.clone();
            mesh.positions[1][2] = bad;
            assert_eq!(mesh.check(), Err(MeshError::NotFinite(1, "position")));
            let mesh = Mesh { normals: vec![[0.0; 3], [0.0; 3], [bad; 3]], ..good.clone() };
            assert_eq!(mesh.check(), Err(MeshError::NotFinite(2, "normal")));
            let mesh = Mesh { uv: vec![[bad; 2], [0.0; 2], [0.0; 2]], ..good.clone() };
            assert_eq!(mesh.check(), Err(MeshError::NotFinite(0, "uv")));
            let mesh = Mesh { second_uv: vec![[0.0; 2], [0.0; 2], [bad; 2]], ..good.clone() };
            assert_eq!(mesh.check(), Err(MeshError::NotFinite(2, "uv")));
        }
    }
}
