//! The part of Embree 3's C interface that the benchmark uses.

use crate::rays::{Answers, Rays};
use std::ffi::{c_char, c_int, c_uint, c_void};
use std::ptr;
use std::sync::atomic::{AtomicIsize, Ordering};
use stride::shape::Mesh;

type Handle = *mut c_void;

/// `RTCRayHit`.
#[repr(C, align(16))]
#[derive(Clone, Copy)]
struct RayHit {
    o: [f32; 3],
    t_near: f32,
    d: [f32; 3],
    time: f32,
    t_far: f32,
    mask: c_uint,
    id: c_uint,
    flags: c_uint,
    normal: [f32; 3],
    u: f32,
    v: f32,
    primitive: c_uint,
    geometry: c_uint,
    instance: c_uint,
}

/// `RTCIntersectContext` for incoherent rays, as in a path tracer.
#[repr(C)]
struct Context {
    flags: c_int,
    filter: *const c_void,
    instance: c_uint,
}

const NONE: c_uint = c_uint::MAX;
const TRIANGLES: c_int = 0;
const INSTANCE: c_int = 121;
const INDEX_BUFFER: c_int = 0;
const VERTEX_BUFFER: c_int = 1;
const UINT3: c_int = 0x5003;
const FLOAT3: c_int = 0x9003;
const FLOAT3X4_COLUMN_MAJOR: c_int = 0x9234;
const ROBUST: c_int = 1 << 2;

#[link(name = "embree3")]
unsafe extern "C" {
    fn rtcNewDevice(config: *const c_char) -> Handle;
    fn rtcReleaseDevice(device: Handle);
    fn rtcSetDeviceMemoryMonitorFunction(
        device: Handle,
        monitor: extern "C" fn(*mut c_void, isize, bool) -> bool,
        user: *mut c_void,
    );
    fn rtcNewScene(device: Handle) -> Handle;
    fn rtcReleaseScene(scene: Handle);
    fn rtcSetSceneFlags(scene: Handle, flags: c_int);
    fn rtcSetSceneBuildQuality(scene: Handle, quality: c_int);
    fn rtcCommitScene(scene: Handle);
    fn rtcNewGeometry(device: Handle, kind: c_int) -> Handle;
    fn rtcReleaseGeometry(geometry: Handle);
    fn rtcSetGeometryBuildQuality(geometry: Handle, quality: c_int);
    fn rtcSetNewGeometryBuffer(
        geometry: Handle,
        kind: c_int,
        slot: c_uint,
        format: c_int,
        stride: usize,
        items: usize,
    ) -> *mut c_void;
    fn rtcSetGeometryInstancedScene(geometry: Handle, scene: Handle);
    fn rtcSetGeometryTransform(geometry: Handle, step: c_uint, format: c_int, transform: *const f32);
    fn rtcCommitGeometry(geometry: Handle);
    fn rtcAttachGeometry(scene: Handle, geometry: Handle) -> c_uint;
    fn rtcIntersect1(scene: Handle, context: *mut Context, ray: *mut RayHit);
    fn rtcOccluded1(scene: Handle, context: *mut Context, ray: *mut RayHit);
}

/// The number of bytes that Embree has allocated, including its copies of vertices and indices.
static BYTES: AtomicIsize = AtomicIsize::new(0);

extern "C" fn count(_user: *mut c_void, bytes: isize, _post: bool) -> bool {
    BYTES.fetch_add(bytes, Ordering::Relaxed);
    true
}

/// `RTCBuildQuality`.
#[derive(Clone, Copy)]
pub enum Quality {
    Medium = 1,
    High = 2,
}

/// An Embree scene in robust mode.
pub struct Embree {
    device: Handle,
    scene: Handle,
    meshes: Vec<Handle>,
    pub bytes: isize,
}

impl Embree {
    /// Meshes, and their instances: the index of a mesh and a matrix by columns. Without instances, only the first
    /// mesh.
    pub fn new(meshes: &[Mesh], places: &[(usize, [f32; 12])], quality: Quality, threads: usize) -> Embree {
        let config = std::ffi::CString::new(format!("threads={threads},set_affinity=0")).expect("no zero");
        // SAFETY: the order of calls is Embree's; every buffer is filled to its length, which Embree has allocated.
        unsafe {
            BYTES.store(0, Ordering::Relaxed);
            let device = rtcNewDevice(config.as_ptr());
            rtcSetDeviceMemoryMonitorFunction(device, count, ptr::null_mut());
            let each: Vec<Handle> = meshes.iter().map(|mesh| of_mesh(device, mesh, quality)).collect();
            let scene = if places.is_empty() { each[0] } else { new_scene(device, quality) };
            for (mesh, place) in places {
                let instance = rtcNewGeometry(device, INSTANCE);
                rtcSetGeometryInstancedScene(instance, each[*mesh]);
                rtcSetGeometryTransform(instance, 0, FLOAT3X4_COLUMN_MAJOR, place.as_ptr());
                rtcSetGeometryBuildQuality(instance, quality as c_int);
                rtcCommitGeometry(instance);
                rtcAttachGeometry(scene, instance);
                rtcReleaseGeometry(instance);
            }
            rtcCommitScene(scene);
            let meshes = if places.is_empty() { Vec::new() } else { each };
            Embree { device, scene, meshes, bytes: BYTES.load(Ordering::Relaxed) }
        }
    }

    /// The first hit of each ray.
    pub fn closest(&self, rays: &Rays, answers: &mut Answers) {
        let mut context = Context { flags: 0, filter: ptr::null(), instance: NONE };
        for i in 0..rays.len() {
            let mut ray = rays.one(i);
            // SAFETY: the scene is committed; ray and context outlive the call.
            unsafe { rtcIntersect1(self.scene, &mut context, &mut ray) };
            answers.t[i] = if ray.geometry == NONE { f32::INFINITY } else { ray.t_far };
            answers.primitive[i] = ray.primitive;
        }
    }

    /// Whether each ray has a hit. Embree sets the distance to −∞ if so.
    pub fn any(&self, rays: &Rays, answers: &mut Answers) {
        let mut context = Context { flags: 0, filter: ptr::null(), instance: NONE };
        for i in 0..rays.len() {
            let mut ray = rays.one(i);
            // SAFETY: as above; `RTCRay` is the first part of `RTCRayHit`.
            unsafe { rtcOccluded1(self.scene, &mut context, &mut ray) };
            answers.t[i] = ray.t_far;
        }
    }
}

impl Rays {
    fn one(&self, i: usize) -> RayHit {
        RayHit {
            o: [self.o[0][i], self.o[1][i], self.o[2][i]],
            t_near: 0.0,
            d: [self.d[0][i], self.d[1][i], self.d[2][i]],
            time: 0.0,
            t_far: f32::INFINITY,
            mask: NONE,
            id: 0,
            flags: 0,
            normal: [0.0; 3],
            u: 0.0,
            v: 0.0,
            primitive: NONE,
            geometry: NONE,
            instance: NONE,
        }
    }
}

/// # Safety
/// The device is open.
unsafe fn new_scene(device: Handle, quality: Quality) -> Handle {
    // SAFETY: no other thread knows the new scene.
    unsafe {
        let scene = rtcNewScene(device);
        rtcSetSceneFlags(scene, ROBUST);
        rtcSetSceneBuildQuality(scene, quality as c_int);
        scene
    }
}

/// # Safety
/// The device is open.
unsafe fn of_mesh(device: Handle, mesh: &Mesh, quality: Quality) -> Handle {
    // SAFETY: Embree allocates each buffer for as many values of the stated size as are copied to it. Positions and
    // triangles are arrays of three 32-bit numbers.
    unsafe {
        let scene = new_scene(device, quality);
        let geometry = rtcNewGeometry(device, TRIANGLES);
        rtcSetGeometryBuildQuality(geometry, quality as c_int);
        let (positions, triangles) = (&mesh.positions, &mesh.triangles);
        let to = rtcSetNewGeometryBuffer(geometry, VERTEX_BUFFER, 0, FLOAT3, 12, positions.len());
        ptr::copy_nonoverlapping(positions.as_ptr(), to.cast(), positions.len());
        let to = rtcSetNewGeometryBuffer(geometry, INDEX_BUFFER, 0, UINT3, 12, triangles.len());
        ptr::copy_nonoverlapping(triangles.as_ptr(), to.cast(), triangles.len());
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene, geometry);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene);
        scene
    }
}

impl Drop for Embree {
    fn drop(&mut self) {
        // SAFETY: each handle was created here and is released once.
        unsafe {
            self.meshes.iter().for_each(|&scene| rtcReleaseScene(scene));
            rtcReleaseScene(self.scene);
            rtcReleaseDevice(self.device);
        }
    }
}
