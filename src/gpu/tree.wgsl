// Twin of `world::bvh`: a tree of eight boxes per node, whose nearer boxes are visited first.
//
// Instead of a stack, the trail keeps eight bits for each level: the boxes that are still to be visited. Nodes know
// their parents. Both fit into registers, so nothing spills to memory.
//
// A group or a shared mesh has a tree of its own, in its own space. At an instance, traversal continues in that tree.
// When the tree is done, traversal returns to the node that led to the instance.

// A ray for box tests.
struct Probe {
    // 1/d. Components near 0 are replaced by LEAST_COMPONENT, so that no product is infinite.
    inverse: vec3f,
    // The error bound of a hit, as a length of t for each axis.
    margin: vec3f,
    // Bit i is set if the ray goes in the negative direction of axis i. The exclusive-or of a box's index with it is
    // the box's position in the order of visits.
    octant: u32,
}

// Smaller components of a direction are replaced by this number.
const LEAST_COMPONENT: f32 = 1e-18;

// The relative rounding error of the distance to a box's side.
const SIDE_ERROR: f32 = 5e-7;

fn probe_of(ray: Ray, share: f32) -> Probe {
    let back = bitcast<vec3u>(ray.d) >> vec3u(31u);
    let magnitude = max(abs(ray.d), vec3f(LEAST_COMPONENT));
    let inverse = select(vec3f(1.0), vec3f(-1.0), back == vec3u(1u)) / magnitude;
    let margin = abs(inverse) * (max_abs(ray.o) * share);
    return Probe(inverse, margin, back.x | (back.y << 1u) | (back.z << 2u));
}

fn four_bytes(word: u32) -> vec4f {
    return vec4f((vec4u(word) >> vec4u(0u, 8u, 16u, 24u)) & vec4u(255u));
}

// The boxes, among four, that a ray enters no later than at `limit`.
fn enters_four(
    low: vec3u,
    high: vec3u,
    base: vec3f,
    step: vec3f,
    slack: vec3f,
    back: vec3<bool>,
    limit: f32,
) -> vec4<bool> {
    let near_x = four_bytes(select(low.x, high.x, back.x)) * step.x + (base.x - slack.x);
    let near_y = four_bytes(select(low.y, high.y, back.y)) * step.y + (base.y - slack.y);
    let near_z = four_bytes(select(low.z, high.z, back.z)) * step.z + (base.z - slack.z);
    let far_x = four_bytes(select(high.x, low.x, back.x)) * step.x + (base.x + slack.x);
    let far_y = four_bytes(select(high.y, low.y, back.y)) * step.y + (base.y + slack.y);
    let far_z = four_bytes(select(high.z, low.z, back.z)) * step.z + (base.z + slack.z);
    let near = max(max(near_x, near_y), max(near_z, vec4f(0.0)));
    let far = min(min(far_x, far_y), min(far_z, vec4f(limit)));
    return near <= far;
}

// The boxes of a node that a ray enters no later than at `limit`. Bit i is set for the box that is ith in the order of
// visits.
fn enters(node: TreeNode, probe: Probe, ray: Ray, limit: f32) -> u32 {
    let exponents = (vec3u(node.scales) >> vec3u(0u, 8u, 16u)) & vec3u(255u);
    let step = bitcast<vec3f>(exponents << vec3u(23u)) * probe.inverse;
    let base = (node.origin - ray.o) * probe.inverse;
    let slack = probe.margin + (abs(base) + abs(step) * 255.0) * SIDE_ERROR;
    let back = probe.inverse < vec3f(0.0);
    let low = vec3u(node.low_x.x, node.low_y.x, node.low_z.x);
    let high = vec3u(node.high_x.x, node.high_y.x, node.high_z.x);
    let first = enters_four(low, high, base, step, slack, back, limit);
    let low_rest = vec3u(node.low_x.y, node.low_y.y, node.low_z.y);
    let high_rest = vec3u(node.high_x.y, node.high_y.y, node.high_z.y);
    let second = enters_four(low_rest, high_rest, base, step, slack, back, limit);
    let turns = vec4u(0u, 1u, 2u, 3u) ^ vec4u(probe.octant);
    let bits = select(vec4u(0u), vec4u(1u) << turns, first)
        | select(vec4u(0u), vec4u(1u) << (turns ^ vec4u(4u)), second);
    return bits.x | bits.y | bits.z | bits.w;
}

// The contents of a leaf: their number in bits 0 to 3, the offset of the first in bits 4 to 11, their kind in bits 12
// to 15.
fn leaf_at(node: TreeNode, place: u32) -> u32 {
    let pair = select(node.leaves.xy, node.leaves.zw, (place & 4u) != 0u);
    let two = select(pair.x, pair.y, (place & 2u) != 0u);
    return (two >> ((place & 1u) * 16u)) & 0xffffu;
}

// The nearest of a hit and the surfaces of a leaf in an instance. At equal distances the lower instance wins, then the
// lower number.
fn leaf_intersect(
    node: TreeNode,
    leaf: u32,
    ray: Ray,
    sheared: ShearedRay,
    instance: u32,
    so_far: SurfaceHit,
) -> SurfaceHit {
    var hit = so_far;
    let kind = leaf >> 12u;
    let first = ((leaf >> 4u) & 255u) + select(node.surfaces, node.triangles, kind == TRIANGLES);
    let end = first + (leaf & 15u);
    for (var i = first; i < end; i++) {
        var t = NOTHING;
        var number = 0u;
        var index = i;
        if TREE_TRIANGLES && kind == TRIANGLES {
            let triangle = triangle_at(i);
            t = triangle_meet(sheared, triangle.a, triangle.b, triangle.c).t;
            number = triangle.number;
            index = i | FIRST_TRIANGLE;
        } else {
            let surface = surface_at(i);
            number = surface.row;
            if TREE_GROUPS && kind == CUSTOM {
                t = surface_intersect(CUSTOM, surface, ray);
            } else if TREE_GROUPS && kind == SPHERES && instance != NO_INSTANCE {
                t = sphere_intersect_any_length(surface, ray);
            } else if kind == SPHERES {
                t = sphere_intersect(surface, ray);
            } else {
                t = quad_intersect(surface, ray);
            }
        }
        let is_lower = instance < hit.instance || (instance == hit.instance && number < hit.number);
        if t < hit.t || (t == hit.t && t < NOTHING && is_lower) {
            hit = SurfaceHit(t, number, index, instance);
        }
    }
    return hit;
}

// The nearest of a hit and all surfaces in the tree. With `any`, the first one found that is nearer than the hit.
fn tree_intersect(world_ray: Ray, so_far: SurfaceHit, any: bool) -> SurfaceHit {
    var ray = world_ray;
    var probe = probe_of(ray, scene.tree_share);
    var sheared = ShearedRay();
    if TREE_TRIANGLES {
        sheared = sheared_ray(ray);
    }
    var hit = so_far;
    var trail = Trail();
    var at = scene.tree_root;
    var node = tree_node_at(at);
    var waiting = enters(node, probe, ray, hit.t);
    // The instance that the ray is in, and the node that leads to it.
    var instance = NO_INSTANCE;
    var outside = NO_NODE;
    loop {
        if waiting == 0u {
            if !trail_waits(trail) {
                break;
            }
            at = node.parent;
            if TREE_INSTANCES && at == NO_NODE {
                at = outside;
                instance = NO_INSTANCE;
                ray = world_ray;
                probe = probe_of(ray, scene.tree_share);
                sheared = sheared_ray(ray);
            }
            node = tree_node_at(at);
            waiting = trail.newest.x & 255u;
            trail = trail_pop(trail);
            continue;
        }
        let place = firstTrailingBit(waiting) ^ probe.octant;
        waiting &= waiting - 1u;
        let inner = node.scales >> 24u;
        if ((inner >> place) & 1u) == 0u {
            let leaf = leaf_at(node, place);
            if !TREE_INSTANCES || (leaf >> 12u) != INSTANCE {
                hit = leaf_intersect(node, leaf, ray, sheared, instance, hit);
                if any && hit.t < so_far.t {
                    break;
                }
                continue;
            }
            outside = at;
            let inside = instance_at(node.triangles + ((leaf >> 4u) & 255u));
            instance = inside.number;
            at = inside.root;
            ray = ray_from(world_ray, inside.to_mesh_x, inside.to_mesh_y, inside.to_mesh_z, inside.origin);
            trail = trail_push(trail, waiting);
            probe = probe_of(ray, SHARE_WITHIN);
            sheared = sheared_ray(ray);
        } else {
            trail = trail_push(trail, waiting);
            at = node.nodes + countOneBits(inner & ((1u << place) - 1u));
        }
        node = tree_node_at(at);
        waiting = enters(node, probe, ray, hit.t);
    }
    return hit;
}
