// Twin of `world::bvh`: eight boxes at a time, the nearer ones first.
//
// The way back up is in registers. Of each node on the way down the trail keeps, in eight bits, which of its boxes
// still wait; from a node its parent's number leads up. Nothing is stored, and so nothing spills.
//
// A group or a shared mesh has a tree of its own, in its own space. A ray that comes to an instance goes on in there, and where
// that tree begins goes back to the node that it came from.

// The ray in the form that box tests use.
struct Probe {
    // 1/d; of what is nearly zero a large number, so that no product is infinite.
    inverse: vec3f,
    // The error of a hit, in units of each axis's t.
    margin: vec3f,
    // Turns a place among a node's boxes into its turn: bit i is set where the ray goes down axis i.
    octant: u32,
}

// The smallest component of a direction that counts.
const LEAST_COMPONENT: f32 = 1e-18;

// How far a box's side may be off along the ray, as a share of what it is computed from.
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

// The boxes, among four, that a ray enters before `limit`.
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

// Which boxes of a node a ray enters no later than at `limit`: bit i is set for the box whose turn is i.
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

// The contents of a leaf: bits 0 to 3 how many, 4 to 11 from which on, 12 to 15 of which kind.
fn leaf_at(node: TreeNode, place: u32) -> u32 {
    let pair = select(node.leaves.xy, node.leaves.zw, (place & 4u) != 0u);
    let two = select(pair.x, pair.y, (place & 2u) != 0u);
    return (two >> ((place & 1u) * 16u)) & 0xffffu;
}

// The nearer of a hit and the things of a leaf in an instance; of equal distances the lower instance, and then the
// lower number.
fn leaf_intersect(
    node: TreeNode,
    leaf: u32,
    ray: Ray,
    sheared: ShearedRay,
    instance: u32,
    so_far: Met,
) -> Met {
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
            hit = Met(t, number, index, instance);
        }
    }
    return hit;
}

// The nearest of a hit and all that is in the tree; where `any` will do, the first that is nearer.
fn tree_intersect(world_ray: Ray, so_far: Met, any: bool) -> Met {
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
