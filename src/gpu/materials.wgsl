// Twin of `material`: checkerboards, and BxDFs in the shading frame.

struct BxdfSample {
    wi: vec3f,
    // f(wo, wi)·|cos θᵢ| / pdf.
    weight: vec3f,
    // Density of `wi`; for a delta lobe, the probability of choosing it.
    pdf: f32,
    delta: bool,
}

// The material at uv: checkerboards choose. Each names only rows before its own, so this ends.
fn resolve(row: u32, uv: vec2f) -> u32 {
    var material = row;
    var at = uv;
    loop {
        let board = material_at(material);
        if board.kind != KIND_CHECKERBOARD {
            break;
        }
        let scaled = at * vec2f(board.number_0, board.number_1);
        let check = floor(scaled);
        let half = (check.x + check.y) * 0.5;
        let is_even = floor(half) >= half;
        material = select(board.choice_1, board.choice_0, is_even);
        at = scaled - check;
    }
    return material;
}

fn reflect_about_normal(w: vec3f) -> vec3f {
    return vec3f(-w.x, -w.y, w.z);
}

fn lambertian_eval(material: Material, wo: vec3f, wi: vec3f) -> vec3f {
    return select(vec3f(0.0), material.colour * FRAC_1_PI, wo.z * wi.z > 0.0);
}

fn lambertian_sample(material: Material, wo: vec3f, u: vec2f) -> BxdfSample {
    let up = cosine_hemisphere(u);
    let pdf = cosine_hemisphere_pdf(up.z);
    return BxdfSample(vec3f(up.xy, copysign(up.z, wo.z)), material.colour, pdf, false);
}

fn lambertian_pdf(wo: vec3f, wi: vec3f) -> f32 {
    return select(0.0, cosine_hemisphere_pdf(abs(wi.z)), wo.z * wi.z > 0.0);
}

fn mirror_sample(material: Material, wo: vec3f) -> BxdfSample {
    return BxdfSample(reflect_about_normal(wo), material.colour, 1.0, true);
}

// Fresnel reflectance and the cosine of refraction.
fn fresnel_dielectric(cos_i: f32, eta: f32) -> vec2f {
    let sin2_t = (1.0 - cos_i * cos_i) / (eta * eta);
    let cos_t = sqrt(float_max(1.0 - sin2_t, 0.0));
    let parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    let perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    let reflectance = (parallel * parallel + perpendicular * perpendicular) * 0.5;
    return select(vec2f(reflectance, cos_t), vec2f(1.0, 0.0), sin2_t >= 1.0);
}

// Glass has its transmittance and its index of refraction among its numbers.
fn transmittance(glass: Material) -> vec3f {
    return vec3f(glass.number_0, glass.number_1, glass.number_2);
}

// The two ways from a point on glass.
struct DielectricBranches {
    reflected: vec3f,
    refracted: vec3f,
    // Probability of reflection; the other way has the rest.
    fresnel: f32,
    // Share of radiance that comes through, squeezed into a smaller solid angle where it enters the denser side.
    transmitted: f32,
}

fn dielectric_branches(material: Material, wo: vec3f) -> DielectricBranches {
    let eta = select(1.0 / material.number_3, material.number_3, wo.z >= 0.0);
    let fresnel = fresnel_dielectric(abs(wo.z), eta);
    let scale = 1.0 / eta;
    let refracted = vec3f(-wo.x * scale, -wo.y * scale, -copysign(fresnel.y, wo.z));
    return DielectricBranches(
        reflect_about_normal(wo),
        refracted,
        fresnel.x,
        (1.0 - fresnel.x) * scale * scale,
    );
}

fn dielectric_sample(material: Material, wo: vec3f, lobe: f32) -> BxdfSample {
    let branches = dielectric_branches(material, wo);
    // The chance of a branch is its Fresnel factor, which therefore cancels.
    if lobe < branches.fresnel {
        return BxdfSample(branches.reflected, material.colour, branches.fresnel, true);
    }
    let chance = 1.0 - branches.fresnel;
    return BxdfSample(branches.refracted, transmittance(material) * (branches.transmitted / chance), chance, true);
}

// η² of a passage from the side of `wo` to the other, through glass; 1 elsewhere.
fn bsdf_eta2_scale(material: Material, wo: vec3f, passes: bool) -> f32 {
    if !passes || !bsdf_transmits(material) {
        return 1.0;
    }
    let eta = select(1.0 / material.number_3, material.number_3, wo.z >= 0.0);
    return eta * eta;
}

// Whether it has a lobe that is not a delta, so that sampling lights makes sense.
fn bsdf_has_non_delta(material: Material) -> bool {
    return material.kind == KIND_MATTE;
}

// Whether it lets light through.
fn bsdf_transmits(material: Material) -> bool {
    return material.kind == KIND_GLASS;
}

// f without delta lobes.
fn bsdf_eval(material: Material, wo: vec3f, wi: vec3f) -> vec3f {
    if material.kind == KIND_MATTE {
        return lambertian_eval(material, wo, wi);
    }
    return vec3f(0.0);
}

// Density of `bsdf_sample` at `wi`, without delta lobes.
fn bsdf_pdf(material: Material, wo: vec3f, wi: vec3f) -> f32 {
    if material.kind == KIND_MATTE {
        return lambertian_pdf(wo, wi);
    }
    return 0.0;
}

fn bsdf_sample(material: Material, wo: vec3f, u: vec2f, lobe: f32) -> BxdfSample {
    switch material.kind {
        case KIND_MIRROR: {
            return mirror_sample(material, wo);
        }
        case KIND_GLASS: {
            return dielectric_sample(material, wo, lobe);
        }
        case KIND_BROKEN: {
            // NaN and infinity, which WGSL cannot name, and which no compiler may know.
            let high = bitcast<vec2f>(vec2u(0x7fc00000u, 0x7f800000u) | vec2u(scene.zero));
            let impossible = vec3f(high, -1.0);
            var weight = impossible.x;
            if lobe >= 1.0 / 3.0 {
                weight = select(impossible.z, impossible.y, lobe < 2.0 / 3.0);
            }
            var sample = lambertian_sample(material, wo, u);
            sample.weight = vec3f(weight);
            return sample;
        }
        default: {
            return lambertian_sample(material, wo, u);
        }
    }
}
