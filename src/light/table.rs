//! Every light that can be sampled, as tables from which each lane can look up another one.

use super::bounds::LightBounds;
use super::cone::Cone;
use super::cylinder::Seen;
use super::lamps::{self, Lamp, MeshLamp};
use super::point::{self, PointLight};
use super::rectangle::Rectangle;
use super::{LightSample, LightTree};
use crate::math::{Float, Frame, Mask, Rgb, Uint, Vec3, trig};
use crate::sampling::warp;
use crate::shape::{Cylinder, Disk, POSITION_ERROR, Quad, Shape, Sides, Sphere};
use std::f32::consts::PI;
use std::ops::Range;

/// The numbers of [`LightRow::kind`]: a point.
pub const POINT: u32 = 0;
/// A sphere.
pub const SPHERE: u32 = 1;
/// A quad.
pub const QUAD: u32 = 2;
/// A triangle.
pub const TRIANGLE: u32 = 3;
/// A disk.
pub const DISK: u32 = 4;
/// A cylinder.
pub const CYLINDER: u32 = 5;

/// One light of a [`LightTable`], for workers that keep the table in another form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightRow {
    /// [`POINT`], [`SPHERE`], [`QUAD`], [`TRIANGLE`], [`DISK`] or [`CYLINDER`].
    pub kind: u32,
    /// Position of a point, centre of a sphere or disk, corner of a quad or triangle, one end of a cylinder's axis.
    pub origin: [f32; 3],
    /// First edge of a quad or triangle, from the corner; a radius of a disk.
    pub edge_u: [f32; 3],
    /// Second edge; the radius at a right angle; a cylinder's axis from end to end.
    pub edge_v: [f32; 3],
    /// Outward normal of a quad, triangle or disk; direction of a cylinder's axis.
    pub normal: [f32; 3],
    /// Radius of a sphere or cylinder.
    pub radius: f32,
    /// Area of all but a point.
    pub area: f32,
    /// The surface's share of the error bound of a point on it.
    pub error: f32,
    /// Whether a sphere or cylinder emits inwards.
    pub inward: bool,
    /// Radiance; intensity of a point.
    pub emission: [f32; 3],
    /// Whether a quad's sides meet at right angles.
    pub square: bool,
    /// Its place in the order of the tree.
    pub place: u32,
    /// Its units of power (see [`LightTree::units`]).
    pub units: u32,
}

/// A surface of finite area that emits from its outward side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AreaLight {
    /// A sphere.
    Sphere(Sphere),
    /// A quad.
    Quad(Quad),
    /// A triangle of a mesh: its corners.
    Triangle([[f32; 3]; 3]),
    /// A disk.
    Disk(Disk),
    /// A cylinder.
    Cylinder(Cylinder),
}

/// The lights that can be sampled, one column for each property, and the tree that chooses among them.
#[derive(Clone, Debug, Default)]
pub struct LightTable {
    kind: Vec<u32>,
    // As in a `LightRow`.
    origin: [Vec<f32>; 3],
    edge_u: [Vec<f32>; 3],
    edge_v: [Vec<f32>; 3],
    normal: [Vec<f32>; 3],
    radius: Vec<f32>,
    area: Vec<f32>,
    /// The surface's share of the error bound of a point on it.
    error: Vec<f32>,
    /// 1 where a sphere or cylinder emits inwards.
    inward: Vec<f32>,
    /// 1 where a quad's sides meet at right angles.
    square: Vec<f32>,
    emission: [Vec<f32>; 3],
    bounds: Vec<LightBounds>,
    tree: LightTree,
    /// Which lights are those of meshes that emit, by mesh.
    meshes: Vec<Range<u32>>,
    /// Meshes of which [`LightTable::lamps`] gives one light.
    mesh_lamps: Vec<MeshLamp>,
    has_points: bool,
    has_spheres: bool,
    has_quads: bool,
    has_triangles: bool,
    has_bulging_mesh: bool,
    /// Whether there are disks or cylinders.
    has_rare: bool,
}

/// From this solid angle on, in steradians, rectangles are sampled by it: of smaller ones the sum of angles that
/// it is made of has lost too many digits, and by area they are sampled about as well.
pub const LEAST_SOLID_ANGLE: f32 = 0.03;

/// Cosine between the sides of a quad up to which it counts as a rectangle.
const SQUARE: f32 = 1e-6;

fn push3(columns: &mut [Vec<f32>; 3], values: [f32; 3]) {
    for (column, value) in columns.iter_mut().zip(values) {
        column.push(value);
    }
}

impl LightTable {
    /// Adds a point light and returns its index.
    pub fn push_point(&mut self, light: PointLight) -> u32 {
        self.has_points = true;
        let zero = [0.0; 3];
        self.push(POINT, light.position, [zero; 3], 0.0, [0.0, 0.0], false, light.intensity);
        self.bounds.push(LightBounds::point(light.position, light.intensity));
        self.bounds.len() as u32 - 1
    }

    /// Adds a surface whose outward side emits `emission` and returns its index.
    pub fn push_area(&mut self, light: AreaLight, flipped: bool, emission: [f32; 3]) -> u32 {
        match light {
            AreaLight::Sphere(sphere) => {
                self.has_spheres = true;
                let surface = sphere.surface();
                // A point on the light is made from the centre and the radius, however large they are.
                let extent = sphere.centre.iter().fold(sphere.radius, |m, x| m.max(x.abs()));
                let sizes = [surface.area, surface.error + extent * POSITION_ERROR];
                self.push(SPHERE, sphere.centre, [[0.0; 3]; 3], sphere.radius, sizes, flipped, emission);
                self.bounds.push(LightBounds::sphere(&sphere, emission));
            }
            AreaLight::Quad(quad) => {
                self.has_quads = true;
                let surface = quad.surface();
                let normal = quad.normal.map(|x| if flipped { -x } else { x });
                let sizes = [surface.area, surface.error];
                self.push(QUAD, quad.corner, [quad.u, quad.v, normal], 0.0, sizes, flipped, emission);
                let [o, u, v] = [quad.corner, quad.u, quad.v];
                let corner = |a: f32, b: f32| [0, 1, 2].map(|c| o[c] + a * u[c] + b * v[c]);
                let corners = [corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0)];
                self.bounds.push(LightBounds::flat(&corners, normal, surface.area, emission));
            }
            AreaLight::Triangle(corners) => {
                self.has_triangles = true;
                let [a, b, c] = corners.map(Vec3::<f32>::splat);
                let (u, v) = (b - a, c - a);
                let sides = Sides::new(u, v);
                let area = sides.area();
                // One without area gives no light, and is never chosen.
                let normal = match area > 0.0 {
                    true => sides.across * (1.0 / sides.length),
                    false => Vec3::splat([0.0, 0.0, 1.0]),
                };
                let normal = if flipped { -normal } else { normal };
                let [edges, normal] = [[u, v], [normal; 2]].map(|v| v.map(|v| [v.x, v.y, v.z]));
                let sizes = [area, sides.error(a)];
                let forms = [edges[0], edges[1], normal[0]];
                self.push(TRIANGLE, corners[0], forms, 0.0, sizes, flipped, emission);
                self.bounds.push(LightBounds::flat(&corners, normal[0], area, emission));
            }
            AreaLight::Disk(disk) => {
                self.has_rare = true;
                let surface = disk.surface();
                let normal = disk.normal.map(|x| if flipped { -x } else { x });
                let ([u, v], sizes) = (disk.radii(), [surface.area, surface.error]);
                self.push(DISK, disk.centre, [u, v, normal], 0.0, sizes, flipped, emission);
                self.bounds.push(LightBounds::disk(&disk, normal, emission));
            }
            AreaLight::Cylinder(cylinder) => {
                self.has_rare = true;
                let surface = cylinder.surface();
                // A point on the light is made from the end and the axis, however far they are.
                let from = cylinder.from();
                let extent = from.iter().fold(2.0 * cylinder.half + cylinder.radius, |m, x| m.max(x.abs()));
                let sizes = [surface.area, surface.error + extent * POSITION_ERROR];
                let along = cylinder.axis.map(|x| x * 2.0 * cylinder.half);
                let forms = [[0.0; 3], along, cylinder.axis];
                self.push(CYLINDER, from, forms, cylinder.radius, sizes, flipped, emission);
                self.bounds.push(LightBounds::cylinder(&cylinder, emission));
            }
        }
        self.bounds.len() as u32 - 1
    }

    /// Adds the triangles of a mesh whose outward side emits `emission` and returns the first one's index.
    pub fn push_mesh(
        &mut self,
        triangles: impl Iterator<Item = [[f32; 3]; 3]>,
        flipped: bool,
        emission: [f32; 3],
    ) -> u32 {
        let first = self.bounds.len() as u32;
        for corners in triangles {
            let light = self.push_area(AreaLight::Triangle(corners), flipped, emission);
            self.bounds[light as usize].mesh = Some(first);
        }
        self.meshes.push(first..self.bounds.len() as u32);
        first
    }

    #[allow(clippy::too_many_arguments, reason = "one value for each column")]
    fn push(
        &mut self,
        kind: u32,
        origin: [f32; 3],
        [u, v, normal]: [[f32; 3]; 3],
        radius: f32,
        [area, error]: [f32; 2],
        inward: bool,
        emission: [f32; 3],
    ) {
        self.kind.push(kind);
        push3(&mut self.origin, origin);
        push3(&mut self.edge_u, u);
        push3(&mut self.edge_v, v);
        push3(&mut self.normal, normal);
        self.radius.push(radius);
        self.area.push(area);
        self.error.push(error);
        self.inward.push(f32::from(u8::from(inward)));
        let [u, v] = [u, v].map(Vec3::<f32>::splat);
        let is_square = kind == QUAD && u.dot(v).abs() <= SQUARE * u.length() * v.length();
        self.square.push(f32::from(u8::from(is_square)));
        push3(&mut self.emission, emission);
    }

    /// Builds the tree that chooses among the lights, once all are there.
    pub fn build_tree(&mut self) {
        self.tree = LightTree::new(&self.bounds);
    }

    /// Makes one lamp of each mesh that emits and has many triangles, once all lights are there (see
    /// [`super::LEAST_TRIANGLES`]).
    pub fn build_lamps(&mut self) {
        let lamps = self.meshes.iter().filter_map(|lights| MeshLamp::new(lights.clone(), &self.bounds));
        self.mesh_lamps = lamps.collect();
    }

    /// The lamps, in the order of their lights: each light by itself, but of meshes that are lamps all together.
    pub fn lamps(&self) -> impl Iterator<Item = Lamp<'_>> {
        lamps::lamps(self.len() as u32, &self.mesh_lamps)
    }

    /// The meshes that are lamps.
    pub fn mesh_lamps(&self) -> &[MeshLamp] {
        &self.mesh_lamps
    }

    /// Builds a tree that chooses every light with the same chance, wherever it is asked from: what the other one
    /// is measured against.
    pub fn build_uniform_tree(&mut self) {
        // Of equal powers, and spread so far that every place is among them: nothing tells them apart.
        let alike = LightBounds::point([0.0; 3], [1.0; 3]);
        let everywhere = LightBounds { lo: [-1e6; 3], hi: [1e6; 3], spread: 1e12, ..alike };
        self.tree = LightTree::new(&vec![everywhere; self.len()]);
    }

    /// Says whether all triangles in the scene are lights of one mesh that bulges: seen from before any of them, all
    /// others lie behind.
    pub fn set_bulging_mesh(&mut self, has_bulging_mesh: bool) {
        self.has_bulging_mesh = has_bulging_mesh;
    }

    /// How many lights there are.
    pub fn len(&self) -> usize {
        self.kind.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.kind.is_empty()
    }

    /// The lights, in the order in which they were added.
    pub fn rows(&self) -> impl Iterator<Item = LightRow> + '_ {
        let at = |columns: &[Vec<f32>; 3], i: usize| [0, 1, 2].map(|c: usize| columns[c][i]);
        (0..self.len()).map(move |i| LightRow {
            kind: self.kind[i],
            origin: at(&self.origin, i),
            edge_u: at(&self.edge_u, i),
            edge_v: at(&self.edge_v, i),
            normal: at(&self.normal, i),
            radius: self.radius[i],
            area: self.area[i],
            error: self.error[i],
            inward: self.inward[i] > 0.0,
            square: self.square[i] > 0.0,
            emission: at(&self.emission, i),
            place: self.tree.place(i),
            units: self.tree.units(i),
        })
    }

    /// The tree that chooses among the lights.
    pub fn tree(&self) -> &LightTree {
        &self.tree
    }

    /// The lanes whose light is a point.
    #[inline(always)]
    pub fn is_point<F: Float>(&self, light: F::Uint) -> F::Mask {
        if !self.has_points {
            return F::Mask::splat(false);
        }
        F::Uint::gather(&self.kind, light).eq(F::Uint::splat(POINT))
    }

    /// The lanes whose light no triangle can hide from where it shines: it is one of those of a mesh that bulges, and
    /// there are no others. To ask them all the same would cost more than all else that a shadow ray asks.
    #[inline(always)]
    pub fn is_past_triangles<F: Float>(&self, light: F::Uint) -> F::Mask {
        if !self.has_bulging_mesh {
            return F::Mask::splat(false);
        }
        F::Uint::gather(&self.kind, light).eq(F::Uint::splat(TRIANGLE))
    }

    /// Chooses a light for a point `p` on a surface with normal `n`, with `u` in [0, 1): its index and the
    /// probability of the choice; where no light can matter, it is any of them. Lanes that do not ask hold nonsense.
    #[inline(always)]
    pub fn choose<F: Float>(&self, p: Vec3<F>, n: Vec3<F>, u: F, asks: F::Mask) -> (F::Uint, F) {
        self.tree.choose(p, n, u, asks)
    }

    /// The probability with which [`LightTable::choose`] chooses a light. Lanes that do not ask hold nonsense.
    #[inline(always)]
    pub fn chance<F: Float>(&self, p: Vec3<F>, n: Vec3<F>, light: F::Uint, asks: F::Mask) -> F {
        self.tree.chance(p, n, light, asks)
    }

    /// A point on a light as seen from `p`, drawn with `u` in [0, 1)².
    #[inline(always)]
    pub fn sample<F: Float>(&self, light: F::Uint, p: Vec3<F>, u: [F; 2]) -> LightSample<F> {
        let kind = F::Uint::gather(&self.kind, light);
        let origin = Vec3::gather(&self.origin, light);
        let emission = Rgb::gather(&self.emission, light);
        let mut sample = point::sample(p, origin, emission);
        if self.has_spheres {
            let lanes = kind.eq(F::Uint::splat(SPHERE));
            if lanes.any() {
                let from_sphere = self.sample_sphere(light, p, origin, emission, u);
                sample = select_sample(lanes, from_sphere, sample);
            }
        }
        if self.has_rare {
            let (disks, cylinders) = (kind.eq(F::Uint::splat(DISK)), kind.eq(F::Uint::splat(CYLINDER)));
            if disks.any() {
                let (x, y) = warp::disk(u);
                sample = select_sample(disks, self.sample_flat(light, p, origin, emission, [x, y]), sample);
            }
            if cylinders.any() {
                let from_cylinder = self.sample_cylinder(light, p, origin, emission, u);
                sample = select_sample(cylinders, from_cylinder, sample);
            }
        }
        if self.has_quads | self.has_triangles {
            let triangles = kind.eq(F::Uint::splat(TRIANGLE));
            let lanes = kind.eq(F::Uint::splat(QUAD)) | triangles;
            if lanes.any() {
                let u = if self.has_triangles { select_pair(triangles, warp::triangle(u), u) } else { u };
                let from_flat = self.sample_flat(light, p, origin, emission, u);
                sample = select_sample(lanes, from_flat, sample);
            }
        }
        sample
    }

    /// Density by solid angle with which [`LightTable::sample`] from `p` would have drawn the direction
    /// `wi`, given that a ray along it met the light at distance `t`, on the side that emits, with the
    /// cosine `cos_light` between the outward normal there and the way back. Points are never met.
    #[inline(always)]
    pub fn pdf<F: Float>(&self, light: F::Uint, p: Vec3<F>, t: F, cos_light: F) -> F {
        let mut pdf = t * t / (cos_light * F::gather(&self.area, light));
        let kind = F::Uint::gather(&self.kind, light);
        let to_origin = Vec3::gather(&self.origin, light) - p;
        if self.has_spheres {
            let sphere = kind.eq(F::Uint::splat(SPHERE));
            let cone = Cone::new(to_origin, F::gather(&self.radius, light));
            // A point on the inside of a sphere may round to its outside: what was met tells where it is.
            let inward = F::gather(&self.inward, light).gt(F::zero());
            pdf = F::select(sphere & cone.outside & !inward, cone.pdf, pdf);
        }
        if self.has_quads {
            let edges = (Vec3::gather(&self.edge_u, light), Vec3::gather(&self.edge_v, light));
            if let Some((by_angle, rectangle)) = self.rectangle(light, to_origin, edges) {
                pdf = F::select(by_angle, F::splat(1.0) / rectangle.solid_angle, pdf);
            }
        }
        if self.has_rare {
            let cylinder = kind.eq(F::Uint::splat(CYLINDER));
            if cylinder.any() {
                let seen = self.cylinder(light, to_origin);
                let inward = F::gather(&self.inward, light).gt(F::zero());
                pdf = F::select(cylinder & seen.outside & !inward, seen.pdf(t, cos_light), pdf);
            }
        }
        pdf
    }

    /// What a cylinder looks like.
    #[inline(always)]
    fn cylinder<F: Float>(&self, light: F::Uint, to_end: Vec3<F>) -> Seen<F> {
        let (axis, along) = (Vec3::gather(&self.normal, light), Vec3::gather(&self.edge_v, light));
        Seen::new(to_end, axis, along.dot(axis), F::gather(&self.radius, light))
    }

    /// The lanes whose light is a rectangle large enough to be sampled by solid angle, if there are any, and
    /// what it looks like.
    #[inline(always)]
    fn rectangle<F: Float>(
        &self,
        light: F::Uint,
        to_corner: Vec3<F>,
        (u, v): (Vec3<F>, Vec3<F>),
    ) -> Option<(F::Mask, Rectangle<F>)> {
        if !self.has_quads {
            return None;
        }
        let square = F::gather(&self.square, light).gt(F::zero());
        if !square.any() {
            return None;
        }
        let rectangle = Rectangle::new(to_corner, u, v);
        Some((square & rectangle.solid_angle.ge(F::splat(LEAST_SOLID_ANGLE)), rectangle))
    }

    /// A sphere seen from outside, uniformly within the cone that it fills (Pharr, Jakob and Humphreys
    /// 2023, §6.2.4); seen from inside, uniformly by area.
    #[inline(always)]
    fn sample_sphere<F: Float>(
        &self,
        light: F::Uint,
        p: Vec3<F>,
        centre: Vec3<F>,
        emission: Rgb<F>,
        u: [F; 2],
    ) -> LightSample<F> {
        let radius = F::gather(&self.radius, light);
        let inward = F::gather(&self.inward, light).gt(F::zero());
        let error = F::gather(&self.error, light);
        let cone = Cone::new(centre - p, radius);

        // 1 − cos θ is uniform; from it sin² θ without cancellation.
        let versine = u[0] * cone.versine;
        let cos = -versine + 1.0;
        let sin2 = versine * (-versine + 2.0);
        let sin = sin2.max(F::zero()).sqrt();
        let (sin_phi, cos_phi) = trig::sin_cos_turns(u[1]);
        let wi = Frame::around(cone.axis).to_world(Vec3::new(sin * cos_phi, sin * sin_phi, cos));
        let near = cone.distance * cos
            - (radius * radius - cone.distance * cone.distance * sin2).max(F::zero()).sqrt();
        let on_cone = p + wi * near;
        let mut normal = (on_cone - centre).normalized();
        let mut direction = wi;
        let mut pdf = cone.pdf;
        let mut shines = cone.outside & !inward;

        // A point on the inner side itself may round to the outside: only what lies there by more than the
        // errors of both is dark.
        let inside = inward & cone.distance.le(radius + error * 4.0);
        if inside.any() {
            let outwards = warp::uniform_sphere(u);
            let to_light = centre + outwards * radius - p;
            let distance2 = to_light.dot(to_light);
            let back = to_light * (F::splat(1.0) / distance2.sqrt());
            let cos = back.dot(outwards);
            normal = Vec3::select(inside, outwards, normal);
            direction = Vec3::select(inside, back, direction);
            pdf = F::select(inside, distance2 / (cos * (radius * radius * (4.0 * PI))), pdf);
            shines = shines | (inside & cos.gt(F::zero()));
        }
        let on_light = centre + normal * radius;
        let off = on_light.max_abs().max(p.max_abs()) * POSITION_ERROR + error;
        let off = F::select(inward, -off, off);
        LightSample {
            wi: direction,
            target: on_light + normal * off,
            radiance: emission.only(shines),
            pdf: pdf.only(shines),
        }
    }

    /// A cylinder seen from outside, by the directions in which it is seen; one that emits inwards, uniformly by area:
    /// of that any part may be seen through an end.
    #[inline(always)]
    fn sample_cylinder<F: Float>(
        &self,
        light: F::Uint,
        p: Vec3<F>,
        end: Vec3<F>,
        emission: Rgb<F>,
        u: [F; 2],
    ) -> LightSample<F> {
        let (axis, along) = (Vec3::gather(&self.normal, light), Vec3::gather(&self.edge_v, light));
        let radius = F::gather(&self.radius, light);
        let inward = F::gather(&self.inward, light).gt(F::zero());
        let seen = self.cylinder(light, end - p);
        let towards = seen.sample(u);
        let mut on_light = end + axis * towards.height + towards.normal * radius;
        let (mut normal, mut wi, mut pdf) = (towards.normal, towards.wi, towards.pdf);
        let mut shines = seen.outside & !inward;
        if inward.any() {
            let (sin, cos) = trig::sin_cos_turns(u[0]);
            let outwards = Frame::around(axis).to_world(Vec3::new(cos, sin, F::zero()));
            let at = end + along * u[1] + outwards * radius;
            let to_light = at - p;
            let distance2 = to_light.dot(to_light);
            let back = to_light * (F::splat(1.0) / distance2.sqrt());
            let cos = back.dot(outwards);
            on_light = Vec3::select(inward, at, on_light);
            normal = Vec3::select(inward, -outwards, normal);
            wi = Vec3::select(inward, back, wi);
            pdf = F::select(inward, distance2 / (cos * F::gather(&self.area, light)), pdf);
            shines = shines | (inward & cos.gt(F::zero()));
        }
        let off = on_light.max_abs().max(p.max_abs()) * POSITION_ERROR + F::gather(&self.error, light);
        LightSample {
            wi,
            target: on_light + normal * off,
            radiance: emission.only(shines),
            pdf: pdf.only(shines),
        }
    }

    /// A quad: a rectangle uniformly by the solid angle that it fills, unless that is small; others, triangles and
    /// disks uniformly by area, whose density of 1/area is distance²/(cos θ·area) by solid angle.
    #[inline(always)]
    fn sample_flat<F: Float>(
        &self,
        light: F::Uint,
        p: Vec3<F>,
        corner: Vec3<F>,
        emission: Rgb<F>,
        u: [F; 2],
    ) -> LightSample<F> {
        let edges = (Vec3::gather(&self.edge_u, light), Vec3::gather(&self.edge_v, light));
        let normal = Vec3::gather(&self.normal, light);
        let rectangle = self.rectangle(light, corner - p, edges);
        let mut at = u;
        if let Some((by_angle, rectangle)) = &rectangle {
            let [a, b] = rectangle.sample(u);
            at = [F::select(*by_angle, a, u[0]), F::select(*by_angle, b, u[1])];
        }
        let on_light = corner + edges.0 * at[0] + edges.1 * at[1];
        let to_light = on_light - p;
        let distance2 = to_light.dot(to_light);
        let wi = to_light * (F::splat(1.0) / distance2.sqrt());
        let cos = -wi.dot(normal);
        let shines = cos.gt(F::zero());
        let off = on_light.max_abs().max(p.max_abs()) * POSITION_ERROR + F::gather(&self.error, light);
        let mut pdf = distance2 / (cos * F::gather(&self.area, light));
        if let Some((by_angle, rectangle)) = &rectangle {
            pdf = F::select(*by_angle, F::splat(1.0) / rectangle.solid_angle, pdf);
        }
        LightSample {
            wi,
            target: on_light + normal * off,
            radiance: emission.only(shines),
            pdf: pdf.only(shines),
        }
    }
}

#[inline(always)]
fn select_pair<F: Float>(mask: F::Mask, a: [F; 2], b: [F; 2]) -> [F; 2] {
    [F::select(mask, a[0], b[0]), F::select(mask, a[1], b[1])]
}

#[inline(always)]
fn select_sample<F: Float>(mask: F::Mask, a: LightSample<F>, b: LightSample<F>) -> LightSample<F> {
    LightSample {
        wi: Vec3::select(mask, a.wi, b.wi),
        target: Vec3::select(mask, a.target, b.target),
        radiance: Rgb::select(mask, a.radiance, b.radiance),
        pdf: F::select(mask, a.pdf, b.pdf),
    }
}

#[cfg(test)]
mod tests;
