// Twin of `camera`: film positions to rays.

fn camera_ray(film: vec2f, lens: vec2f) -> Ray {
    let leftward = (scene.centre.x - film.x) * scene.pixel_side;
    let upward = (scene.centre.y - film.y) * scene.pixel_side;
    let pinhole = scene.forward + scene.left * leftward + scene.up * upward;
    var o = scene.eye;
    var to_plane = pinhole;
    if scene.aperture_radius > 0.0 {
        let at = disk(lens);
        let shift = (scene.left * at.x + scene.up * at.y) * scene.aperture_radius;
        o += shift;
        to_plane = pinhole * scene.focus_distance - shift;
    }
    let d = normalized(to_plane);
    if scene.near > 0.0 {
        o += d * (scene.near / dot(d, scene.forward));
    }
    return Ray(o, d);
}
