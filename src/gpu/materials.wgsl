// Twin of `material`: checkerboards, and BxDFs in the shading frame.

struct BxdfSample {
    wi: vec3f,
    // f(wo, wi)·|cos θᵢ| / pdf.
    weight: vec3f,
}

// The material at uv: checkerboards choose. Each names only rows before its own, so this ends.
fn resolve(row: u32, uv: vec2f) -> u32 {
    var material = row;
    var at = uv;
    while materials[material].kind == KIND_CHECKERBOARD {
        let scaled = at * materials[material].checks_per_unit;
        let check = floor(scaled);
        let half = (check.x + check.y) * 0.5;
        let is_even = floor(half) >= half;
        material = select(materials[material].checks.y, materials[material].checks.x, is_even);
        at = scaled - check;
    }
    return material;
}

fn reflect_about_normal(w: vec3f) -> vec3f {
    return vec3f(-w.x, -w.y, w.z);
}

fn lambertian_eval(material: Material, wo: vec3f, wi: vec3f) -> vec3f {
    return select(vec3f(0.0), material.reflectance * FRAC_1_PI, wo.z * wi.z > 0.0);
}

fn lambertian_sample(material: Material, wo: vec3f, u: vec2f) -> BxdfSample {
    let up = cosine_hemisphere(u);
    return BxdfSample(vec3f(up.xy, copysign(up.z, wo.z)), material.reflectance);
}

fn mirror_sample(material: Material, wo: vec3f) -> BxdfSample {
    return BxdfSample(reflect_about_normal(wo), material.reflectance);
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

fn dielectric_sample(material: Material, wo: vec3f, lobe: f32) -> BxdfSample {
    let eta = select(1.0 / material.ior, material.ior, wo.z >= 0.0);
    let fresnel = fresnel_dielectric(abs(wo.z), eta);
    // The chance of a branch is its Fresnel factor, which therefore cancels.
    if lobe < fresnel.x {
        return BxdfSample(reflect_about_normal(wo), material.reflectance);
    }
    let scale = 1.0 / eta;
    let refracted = vec3f(-wo.x * scale, -wo.y * scale, -copysign(fresnel.y, wo.z));
    return BxdfSample(refracted, material.transmittance * (scale * scale));
}

// f without delta lobes.
fn bsdf_eval(material: Material, wo: vec3f, wi: vec3f) -> vec3f {
    if material.kind == KIND_MATTE {
        return lambertian_eval(material, wo, wi);
    }
    return vec3f(0.0);
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
            // The host keeps the three impossible weights in the transmittance: WGSL cannot name them.
            let impossible = material.transmittance;
            var weight = impossible.x;
            if lobe >= 1.0 / 3.0 {
                weight = select(impossible.z, impossible.y, lobe < 2.0 / 3.0);
            }
            return BxdfSample(lambertian_sample(material, wo, u).wi, vec3f(weight));
        }
        default: {
            return lambertian_sample(material, wo, u);
        }
    }
}
