//! Writing of meshes as PLY, in little-endian numbers of 32 bits, the precision of meshes in memory.

use crate::scene::description::Mesh;
use std::io::{self, Write};

/// Writes a mesh.
pub(super) fn write(mesh: &Mesh, mut out: impl Write) -> io::Result<()> {
    let property =
        |names: &[&str]| names.iter().map(|name| format!("property float {name}\n")).collect::<String>();
    let normals = if mesh.normals.is_empty() { String::new() } else { property(&["nx", "ny", "nz"]) };
    let uv = if mesh.uv.is_empty() { String::new() } else { property(&["u", "v"]) };
    let second_uv = if mesh.second_uv.is_empty() { String::new() } else { property(&["u1", "v1"]) };
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\n{}{normals}{uv}{second_uv}element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        mesh.positions.len(),
        property(&["x", "y", "z"]),
        mesh.triangles.len(),
    )?;
    let numbers = |numbers: &[f32], out: &mut dyn Write| -> io::Result<()> {
        numbers.iter().try_for_each(|number| out.write_all(&number.to_le_bytes()))
    };
    for (i, position) in mesh.positions.iter().enumerate() {
        numbers(position, &mut out)?;
        if let Some(normal) = mesh.normals.get(i) {
            numbers(normal, &mut out)?;
        }
        for uv in [&mesh.uv, &mesh.second_uv] {
            if let Some(uv) = uv.get(i) {
                numbers(uv, &mut out)?;
            }
        }
    }
    for triangle in &mesh.triangles {
        out.write_all(&[3])?;
        triangle.iter().try_for_each(|corner| out.write_all(&corner.to_le_bytes()))?;
    }
    Ok(())
}
