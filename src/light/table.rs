//! Every light that can be sampled, as tables from which each lane can look up another one.

use super::bounds::LightBounds;
use super::cylinder::Seen;
use super::point::{self, PointLight};
use super::rectangle::Rectangle;
use super::{LightSample, LightTree};
use crate::math::{Float, Frame, Mask, Rgb, Uint, Vec3, trig};
use crate::sampling::warp;
use crate::shape::{Cylinder, Disk, POSITION_ERROR, Quad, Shape, Sphere, triangle_error};
use std::f32::consts::{FRAC_1_PI, PI};

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
                let doubled = u.cross(v);
                let area = 0.5 * doubled.length();
                // One without area gives no light, and is never chosen.
                let normal = if area > 0.0 { doubled * (0.5 / area) } else { Vec3::splat([0.0, 0.0, 1.0]) };
                let normal = if flipped { -normal } else { normal };
                let [edges, normal] = [[u, v], [normal; 2]].map(|v| v.map(|v| [v.x, v.y, v.z]));
                let sizes = [area, triangle_error(a, u, v)];
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
    /// probability of the choice, which is zero where no light can matter. Lanes that do not ask hold nonsense.
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
        let off = on_light.max_abs() * POSITION_ERROR + error;
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
        let off = on_light.max_abs() * POSITION_ERROR + F::gather(&self.error, light);
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
        let off = on_light.max_abs() * POSITION_ERROR + F::gather(&self.error, light);
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

/// The cone of directions in which a point sees a sphere.
struct Cone<F: Float> {
    /// Direction to the centre, of length one.
    axis: Vec3<F>,
    /// Distance to the centre.
    distance: F,
    /// 1 − cos of half the opening angle.
    versine: F,
    /// Density of a uniform direction within, by solid angle.
    pdf: F,
    /// Whether the point is outside the sphere; if not, nothing else here means anything.
    outside: F::Mask,
}

impl<F: Float> Cone<F> {
    #[inline(always)]
    fn new(to_centre: Vec3<F>, radius: F) -> Self {
        let distance2 = to_centre.dot(to_centre);
        let distance = distance2.sqrt();
        let sin2 = radius * radius / distance2;
        let outside = sin2.lt(F::splat(1.0));
        let cos = (-sin2 + 1.0).max(F::zero()).sqrt();
        // 1 − cos without cancellation, for a sphere that is far away.
        let versine = sin2 / (cos + 1.0);
        Cone {
            axis: to_centre * (F::splat(1.0) / distance),
            distance,
            versine,
            pdf: F::splat(0.5 * FRAC_1_PI) / versine,
            outside,
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
mod tests {
    use super::*;
    use crate::math::lanes::scalar::Wrapping;
    use crate::shape::Shears;
    use glam::DVec3;

    fn table(light: AreaLight, flipped: bool, emission: f32) -> LightTable {
        let mut table = LightTable::default();
        table.push_area(light, flipped, [emission; 3]);
        table.build_tree();
        table
    }

    /// The mean of `n²` stratified samples of the irradiance on a surface at the origin facing +z.
    fn irradiance(table: &LightTable, n: u32) -> f64 {
        let mut sum = 0.0;
        for i in 0..n * n {
            let u = [(i / n) as f32 + 0.5, (i % n) as f32 + 0.5].map(|x| x / n as f32);
            let sample = table.sample(Wrapping(0), Vec3::<f32>::zero(), u);
            sum += f64::from(sample.weight().r * sample.wi.z.max(0.0));
        }
        sum / f64::from(n * n)
    }

    #[test]
    fn a_sphere_gives_the_irradiance_of_its_cone() {
        // E = π·L·sin²θ for a sphere straight above, sin θ = r/distance.
        for (distance, radius) in [(4.0, 1.0), (1000.0, 1.0), (1.001, 1.0)] {
            let sphere = Sphere::new(DVec3::Z * distance, radius);
            let expected = std::f64::consts::PI * 2.0 * (radius / distance).powi(2);
            let got = irradiance(&table(AreaLight::Sphere(sphere), false, 2.0), 200);
            assert!((got / expected - 1.0).abs() < 1e-3, "{got} is not {expected}");
            // Seen from outside, a sphere that emits inwards is dark.
            assert_eq!(irradiance(&table(AreaLight::Sphere(sphere), true, 2.0), 20), 0.0);
        }
    }

    #[test]
    fn a_sphere_around_us_lights_us_as_a_sky() {
        // From inside, radiance is L everywhere: E = π·L, wherever we stand.
        for z in [0.0, 0.7, -0.5] {
            let sphere = Sphere::new(DVec3::Z * z, 1.0);
            let got = irradiance(&table(AreaLight::Sphere(sphere), true, 1.0), 400);
            assert!((got / std::f64::consts::PI - 1.0).abs() < 3e-3, "{got} is not π");
            assert_eq!(irradiance(&table(AreaLight::Sphere(sphere), false, 1.0), 20), 0.0);
        }
    }

    #[test]
    fn a_quad_gives_the_irradiance_of_its_form_factor() {
        // The form factor of a unit square 1 above the middle is 4 times that of a corner patch of ½ × ½
        // (Howell, configuration C-13).
        let quad = Quad::new(DVec3::new(-0.5, -0.5, 1.0), DVec3::Y, DVec3::X);
        let s = 1.25_f64.sqrt();
        let expected = 4.0 * (0.5 / s * (0.5 / s).atan());
        let got = irradiance(&table(AreaLight::Quad(quad), false, 1.0), 200);
        assert!((got / expected - 1.0).abs() < 1e-4, "{got} is not {expected}");
        assert_eq!(irradiance(&table(AreaLight::Quad(quad), true, 1.0), 10), 0.0);
    }

    #[test]
    fn a_disk_gives_the_irradiance_of_its_form_factor() {
        // A disk straight above fills a cone: E = π·L·r²/(r² + distance²).
        for (distance, radius) in [(1.0, 1.0), (0.5, 1.0), (50.0, 1.0)] {
            let disk = Disk::new(DVec3::Z * distance, DVec3::NEG_Z, radius);
            let expected = std::f64::consts::PI * radius * radius / (radius * radius + distance * distance);
            let got = irradiance(&table(AreaLight::Disk(disk), false, 1.0), 300);
            assert!((got / expected - 1.0).abs() < 1e-3, "{got} is not {expected}");
            assert_eq!(irradiance(&table(AreaLight::Disk(disk), true, 1.0), 10), 0.0);
        }
    }

    #[test]
    fn a_cylinder_gives_the_irradiance_of_its_solid_angle() {
        // One that lies across the zenith, at an angle β to it on either side and as wide as a sine s: of the strip of
        // directions (α, β) about its axis, cos θ = cos α·cos β. Seen from its axis's height it is a whole strip, from
        // end to end, whose ends depend on α only by the distance to it.
        let integral = |height: f64, radius: f64, half: f64| {
            let (n, widest) = (2000, (radius / height).asin());
            let sum: f64 = (0..n)
                .map(|i| {
                    let alpha = widest * ((f64::from(i) + 0.5) / f64::from(n) * 2.0 - 1.0);
                    let chord = (radius * radius - (height * alpha.sin()).powi(2)).sqrt();
                    let rise = (half / (height * alpha.cos() - chord)).atan();
                    // ∫ cos β · cos β dβ from −rise to rise.
                    alpha.cos() * (rise + 0.5 * (2.0 * rise).sin())
                })
                .sum();
            sum * 2.0 * widest / f64::from(n)
        };
        for (height, radius, half) in
            [(2.0, 1.0, 1.5), (1.05, 1.0, 20.0), (300.0, 1.0, 4.0), (2.0, 0.01, 0.01)]
        {
            let ends = [-half, half].map(|y| DVec3::new(0.0, y, height));
            let cylinder = Cylinder::new(ends[0], ends[1], radius);
            let expected = integral(height, radius, half);
            let got = irradiance(&table(AreaLight::Cylinder(cylinder), false, 1.0), 200);
            assert!((got / expected - 1.0).abs() < 1e-3, "{got} is not {expected}");
        }
    }

    #[test]
    fn a_long_tube_around_us_lights_us_as_a_sky() {
        let tube = Cylinder::new(DVec3::new(0.2, -300.0, 0.1), DVec3::new(0.2, 300.0, 0.1), 1.0);
        let table = table(AreaLight::Cylinder(tube), true, 1.0);
        // By area, most samples are far away: many are needed.
        let got = irradiance(&table, 2000);
        assert!((got / std::f64::consts::PI - 1.0).abs() < 1e-2, "{got} is not π");
    }

    #[test]
    fn two_triangles_give_the_irradiance_of_their_square() {
        let (s, expected) = (1.25_f64.sqrt(), |s: f64| 4.0 * (0.5 / s * (0.5 / s).atan()));
        let corner = |x: f32, y: f32| [x - 0.5, y - 0.5, 1.0];
        let halves = [
            [corner(0.0, 0.0), corner(0.0, 1.0), corner(1.0, 0.0)],
            [corner(1.0, 1.0), corner(1.0, 0.0), corner(0.0, 1.0)],
        ];
        let sum: f64 =
            halves.map(|half| irradiance(&table(AreaLight::Triangle(half), false, 1.0), 200)).iter().sum();
        assert!((sum / expected(s) - 1.0).abs() < 1e-4, "{sum} is not {}", expected(s));
        assert_eq!(irradiance(&table(AreaLight::Triangle(halves[0]), true, 1.0), 10), 0.0);
        // A triangle without area is never chosen, and spoils nothing.
        let mut with_none = LightTable::default();
        with_none.push_area(AreaLight::Triangle([[0.0, 0.0, 2.0]; 3]), false, [1.0; 3]);
        with_none.push_area(AreaLight::Triangle(halves[0]), false, [1.0; 3]);
        with_none.build_tree();
        let up = Vec3::<f32>::splat([0.0, 0.0, 1.0]);
        for u in [0.0, 0.3, 0.999] {
            let (light, chance) = with_none.choose(Vec3::zero(), up, u, true);
            assert_eq!((light.0, chance), (1, 1.0));
        }
    }

    #[test]
    fn the_density_of_a_met_light_is_that_of_the_sample() {
        let sphere = AreaLight::Sphere(Sphere::new(DVec3::new(1.0, 2.0, 5.0), 1.5));
        let around = AreaLight::Sphere(Sphere::new(DVec3::new(0.3, -0.2, 0.1), 3.0));
        let quad = AreaLight::Quad(Quad::new(DVec3::new(-1.0, -1.0, 3.0), DVec3::Y, DVec3::X * 2.0));
        let triangle = AreaLight::Triangle([[-1.0, -1.0, 3.0], [-1.0, 2.0, 3.5], [1.5, -1.0, 2.5]]);
        let disk = AreaLight::Disk(Disk::new(DVec3::new(1.0, 0.5, 3.0), DVec3::new(0.0, -0.6, -0.8), 1.5));
        let [from, to] = [DVec3::new(1.0, 2.0, 3.0), DVec3::new(-1.0, 2.5, 5.0)];
        let tube = AreaLight::Cylinder(Cylinder::new(from, to, 0.5));
        let shade = AreaLight::Cylinder(Cylinder::new(DVec3::NEG_Z, DVec3::new(0.1, 0.2, 2.0), 1.5));
        for (light, flipped) in [
            (sphere, false),
            (around, true),
            (quad, false),
            (triangle, false),
            (disk, false),
            (tube, false),
            (shade, true),
        ] {
            let table = table(light, flipped, 1.0);
            for u in [[0.1, 0.2], [0.5, 0.5], [0.9, 0.8]] {
                let p = Vec3::<f32>::zero();
                let sample = table.sample(Wrapping(0), p, u);
                let ray = crate::math::Ray { o: p, d: sample.wi };
                let (t, normal) = match light {
                    AreaLight::Sphere(s) => {
                        let t = s.intersect(&ray);
                        let out = (ray.at(t) - Vec3::splat(s.centre)).normalized();
                        (t, if flipped { -out } else { out })
                    }
                    AreaLight::Quad(q) => (q.intersect(&ray), Vec3::splat(q.normal)),
                    AreaLight::Disk(d) => (d.intersect(&ray), Vec3::splat(d.normal)),
                    AreaLight::Cylinder(c) => {
                        let t = c.intersect(&ray);
                        let w = ray.at(t) - Vec3::splat(c.middle);
                        let axis = Vec3::splat(c.axis);
                        let out = (w - axis * w.dot(axis)).normalized();
                        (t, if flipped { -out } else { out })
                    }
                    AreaLight::Triangle(corners) => {
                        let [a, b, c] = corners.map(Vec3::splat);
                        (Shears::new(&ray).meet([a, b, c]).t, (b - a).cross(c - a).normalized())
                    }
                };
                let pdf = table.pdf(Wrapping(0), p, t, -sample.wi.dot(normal));
                assert!((pdf / sample.pdf - 1.0).abs() < 1e-4, "{pdf} is not {}", sample.pdf);
            }
        }
    }
}
