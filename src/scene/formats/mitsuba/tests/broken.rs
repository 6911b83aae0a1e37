//! Files with one error each, and the messages of the reader.

use super::{errors, whole};

/// A test that a scene with the elements `$body`, from line 2 on, is refused with the messages.
macro_rules! broken {
    ($name:ident, $body:expr, [$($message:expr),+ $(,)?]) => {
        #[test]
        fn $name() {
            let messages = [$($message),+].map(|message| format!("a.xml:{message}"));
            assert_eq!(errors(&whole($body)), messages);
        }
    };
}

/// A test that a file with this text is refused with the messages.
macro_rules! broken_text {
    ($name:ident, $text:expr, [$($message:expr),+ $(,)?]) => {
        #[test]
        fn $name() {
            let messages = [$($message),+].map(|message| format!("a.xml:{message}"));
            assert_eq!(errors($text), messages);
        }
    };
}

broken_text!(nothing, "", ["1:1: this is not XML: the document does not have a root node"]);
broken_text!(
    an_element_that_does_not_end,
    "<scene version=\"3.0.0\">\n<shape type=\"sphere\">\n</scene>",
    ["3:1: this is not XML: expected 'shape' tag, not 'scene'"]
);
broken_text!(
    a_document_type,
    "<!DOCTYPE a [<!ENTITY b \"c\">]><scene version=\"3.0.0\"/>",
    ["1:1: document type declarations are not supported"]
);
broken_text!(
    another_root,
    "<shape type=\"sphere\"/>",
    ["1:1: the outermost element is \"shape\", not \"scene\"; name the file that includes this one"]
);
broken_text!(
    the_root_of_another_program,
    "<project/>",
    ["1:1: the outermost element is \"project\", not \"scene\"; this is not a scene of Mitsuba"]
);
broken_text!(no_version, "<scene/>", ["1:1: <scene> has no version; write <scene version=\"3.0.0\">"]);
broken_text!(
    an_old_version,
    "<scene version=\"0.6.0\"/>",
    [
        "1:1: this file is of Mitsuba \"0.6.0\"; files of Mitsuba 2 and 3 are read; Mitsuba 3 itself converts older ones"
    ]
);
broken_text!(no_number_for_a_version, "<scene version=\"new\"/>", ["1:1: \"new\" is not a version"]);
broken_text!(
    no_sensor,
    "<scene version=\"3.0.0\"/>",
    ["1:1: the scene has no sensor; add one, or name a file that includes this one and has one"]
);

broken!(
    an_unknown_element,
    "<shap type=\"sphere\"/>",
    ["2:1: unknown element <shap>; did you mean \"shape\"?"]
);
broken!(an_object_without_a_type, "<shape/>", ["2:1: <shape> has no type"]);
broken!(
    an_unknown_attribute,
    "<shape type=\"sphere\" nam=\"a\"/>",
    ["2:1: <shape> has no attribute \"nam\"; did you mean \"name\"?"]
);
broken!(
    two_objects_of_one_id,
    "<bsdf type=\"diffuse\" id=\"a\"/>\n<bsdf type=\"diffuse\" id=\"a\"/>",
    ["3:1: two objects have the id \"a\""]
);
broken!(
    an_unknown_reference,
    "<bsdf type=\"diffuse\" id=\"white\"/>\n<shape type=\"sphere\"><ref id=\"whit\"/></shape>",
    ["3:22: no object has the id \"whit\"; did you mean \"white\"?"]
);
broken!(
    an_object_in_itself,
    "<bsdf type=\"twosided\" id=\"a\"><ref id=\"a\"/></bsdf>",
    ["2:30: bsdf \"twosided\" contains itself"]
);
broken!(
    a_circle_of_objects,
    "<bsdf type=\"twosided\" id=\"a\"><ref id=\"b\"/></bsdf>\n<bsdf type=\"twosided\" id=\"b\"><ref id=\"a\"/></bsdf>",
    ["3:30: bsdf \"twosided\" contains itself"]
);
broken!(
    an_unknown_variable,
    "<shape type=\"$kind\"/>",
    ["2:1: there is no variable \"$kind\"; set it with -D kind=VALUE or <default>"]
);
broken!(
    a_number_that_is_none,
    "<shape type=\"sphere\"><float name=\"radius\" value=\"1,5\"/></shape>",
    ["2:22: radius must be a number, not \"1,5\""]
);
broken!(
    an_infinite_number,
    "<shape type=\"sphere\"><float name=\"radius\" value=\"1e999\"/></shape>",
    ["2:22: radius must be a number, not \"1e999\""]
);
broken!(
    a_whole_number_that_is_none,
    "<integrator type=\"path\"><integer name=\"max_depth\" value=\"5.5\"/></integrator>",
    ["2:25: max_depth must be a whole number, not \"5.5\""]
);
broken!(
    neither_true_nor_false,
    "<shape type=\"sphere\"><boolean name=\"flip_normals\" value=\"yes\"/></shape>",
    ["2:22: flip_normals must be true or false, not \"yes\""]
);
broken!(
    a_colour_of_two_numbers,
    "<bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0.1 0.2\"/></bsdf>",
    ["2:22: reflectance must be one number or three, not \"0.1 0.2\""]
);
broken!(
    a_property_that_is_given_twice,
    "<bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0\"/><rgb name=\"reflectance\" value=\"1\"/></bsdf>",
    ["2:57: \"reflectance\" is given twice"]
);
broken!(
    a_property_without_a_name,
    "<shape type=\"sphere\"><float value=\"1\"/></shape>",
    ["2:22: <float> has no name"]
);
broken!(
    a_value_of_another_type,
    "<shape type=\"sphere\"><string name=\"radius\" value=\"1\"/></shape>",
    ["2:22: radius of shape \"sphere\" must be a float, not a string"]
);
broken!(
    a_value_beside_coordinates,
    "<shape type=\"sphere\"><point name=\"center\" value=\"1\" x=\"2\"/></shape>",
    ["2:22: value cannot be combined with x, y or z"]
);
broken!(
    a_spectrum_that_goes_back,
    "<emitter type=\"constant\"><spectrum name=\"radiance\" value=\"500:1, 400:2\"/></emitter>",
    ["2:26: the wavelengths of a spectrum must increase"]
);
broken!(
    a_spectrum_of_nothing,
    "<emitter type=\"constant\"><spectrum name=\"radiance\"/></emitter>",
    ["2:26: <spectrum> has either a value or a filename"]
);
broken!(
    an_unknown_step,
    "<shape type=\"sphere\"><transform name=\"to_world\"><shear x=\"1\"/></transform></shape>",
    [
        "2:49: <shear> is no step of a transform; valid here: \"translate\", \"scale\", \"rotate\", \"lookat\", \"matrix\""
    ]
);
broken!(
    a_matrix_of_eight_numbers,
    "<shape type=\"sphere\"><transform name=\"to_world\"><matrix value=\"1 2 3 4 5 6 7 8\"/></transform></shape>",
    ["2:49: a matrix has 9 or 16 numbers, not 8"]
);
broken!(
    a_rotation_about_nothing,
    "<shape type=\"sphere\"><transform name=\"to_world\"><rotate angle=\"90\"/></transform></shape>",
    ["2:49: the axis of a rotation is zero"]
);
broken!(
    a_rotation_by_nothing,
    "<shape type=\"sphere\"><transform name=\"to_world\"><rotate x=\"1\"/></transform></shape>",
    ["2:49: angle must be a number of degrees"]
);
broken!(
    a_view_along_up,
    "<shape type=\"sphere\"><transform name=\"to_world\"><lookat origin=\"0 0 0\" target=\"0 0 1\" up=\"0 0 2\"/></transform></shape>",
    ["2:49: up is parallel to the viewing direction, or target is origin"]
);
broken!(
    a_flat_transform,
    "<shape type=\"sphere\"><transform name=\"to_world\"><scale z=\"0\"/></transform></shape>",
    ["2:22: the transform is singular"]
);
broken!(
    a_perspective_transform,
    "<shape type=\"sphere\"><transform name=\"to_world\"><matrix value=\"1 0 0 0  0 1 0 0  0 0 1 0  0 0 1 1\"/></transform></shape>",
    ["2:22: the last row of this transform is not 0 0 0 1"]
);
broken!(
    an_unknown_conductor,
    "<shape type=\"sphere\"><bsdf type=\"conductor\"><string name=\"material\" value=\"au\"/></bsdf></shape>",
    ["2:45: no conductor is called \"au\"; did you mean \"Au\"?"]
);
broken!(
    an_unknown_dielectric,
    "<shape type=\"sphere\"><bsdf type=\"dielectric\"><string name=\"int_ior\" value=\"diamonds\"/></bsdf></shape>",
    ["2:46: no dielectric is called \"diamonds\"; did you mean \"diamond\"?"]
);
broken!(
    one_alpha_of_two,
    "<shape type=\"sphere\"><bsdf type=\"roughconductor\"><float name=\"alpha_u\" value=\"0.1\"/></bsdf></shape>",
    ["2:22: bsdf \"roughconductor\" has either alpha, or both alpha_u and alpha_v"]
);
broken!(
    an_unknown_distribution,
    "<shape type=\"sphere\"><bsdf type=\"roughconductor\"><string name=\"distribution\" value=\"phong\"/></bsdf></shape>",
    ["2:50: distribution of bsdf \"roughconductor\" must be beckmann or ggx, not \"phong\""]
);
broken!(
    a_wrapper_around_nothing,
    "<shape type=\"sphere\"><bsdf type=\"twosided\"/></shape>",
    ["2:22: bsdf \"twosided\" has no bsdf in it"]
);
broken!(
    a_reflectance_above_one,
    "<shape type=\"sphere\"><bsdf type=\"diffuse\" id=\"a\"><rgb name=\"reflectance\" value=\"2\"/></bsdf></shape>",
    ["2:22: material 1 (\"a\"): reflectance must be from 0 to 1, not 2e0",]
);
broken!(
    a_sphere_without_a_size,
    "<shape type=\"sphere\" id=\"a\"><float name=\"radius\" value=\"0\"/></shape>",
    ["2:1: entity 1 (\"a\"): radius must be above 0, not 0e0"]
);
broken!(
    a_cylinder_without_a_length,
    "<shape type=\"cylinder\"><point name=\"p1\" value=\"0\"/></shape>",
    ["2:1: p0 and p1 of shape \"cylinder\" are one point"]
);
broken!(a_mesh_without_a_file, "<shape type=\"ply\"/>", ["2:1: shape \"ply\" has no filename"]);
broken!(
    a_mesh_that_is_not_there,
    "<shape type=\"ply\"><string name=\"filename\" value=\"nowhere.ply\"/></shape>",
    ["2:19: there is no file \"nowhere.ply\" in the scene's folder, nor where <path> points"]
);
broken!(
    an_instance_of_nothing,
    "<shape type=\"instance\"/>",
    ["2:1: an instance must refer to a shapegroup"]
);
broken!(a_light_on_no_surface, "<emitter type=\"area\"/>", ["2:1: an area light must be inside a shape"]);
broken!(
    a_light_without_a_direction,
    "<emitter type=\"directional\"><vector name=\"direction\" value=\"0\"/></emitter>",
    ["2:1: emitter \"directional\" has no direction"]
);
broken!(
    a_cold_black_body,
    "<emitter type=\"constant\"><texture type=\"blackbody\" name=\"radiance\"/></emitter>",
    ["2:26: a temperature must be above 0 and at most 1e6 K"]
);
broken!(
    a_path_in_an_object,
    "<shape type=\"sphere\"><path value=\"a\"/></shape>",
    ["2:22: <path> must be a child of <scene>"]
);
broken!(
    a_depth_below_all,
    "<integrator type=\"path\"><integer name=\"max_depth\" value=\"-2\"/></integrator>",
    ["2:1: max_depth must be −1, or 0 and above, not -2"]
);
broken!(
    an_instance_in_a_group,
    "<shape type=\"shapegroup\" id=\"a\"><shape type=\"cube\"/></shape>\n<shape type=\"shapegroup\" id=\"b\"><shape type=\"merge\"><shape type=\"instance\"><ref id=\"a\"/></shape></shape></shape>\n<shape type=\"instance\"><ref id=\"b\"/></shape>",
    ["3:53: a shapegroup cannot contain an instance"]
);
broken!(
    many_attributes,
    &format!("<shape {}/>", (0..40).map(|i| format!("a{i}=\"\" ")).collect::<String>()),
    ["2:1: an element has more than 32 attributes"]
);
broken!(a_namespace, "<shape xmlns:a=\"b\" type=\"sphere\"/>", ["2:1: namespaces of XML are not read"]);
broken!(
    a_variable_with_a_dollar_sign_in_its_name,
    "<default name=\"a\\$b\" value=\"1\"/>",
    ["2:1: a variable cannot be called \"a$b\""]
);
broken!(
    a_variable_without_a_name,
    "<default name=\"\" value=\"1\"/>",
    ["2:1: a variable cannot be called \"\""]
);
broken!(
    an_alias_of_nothing,
    "<alias id=\"a\" as=\"b\"/>\n<bsdf type=\"diffuse\" id=\"a\"/>",
    ["2:1: no object before it has the id \"a\""]
);
broken!(
    an_alias_that_is_there_already,
    "<bsdf type=\"diffuse\" id=\"a\"/>\n<alias id=\"a\" as=\"a\"/>",
    ["3:1: two objects have the id \"a\""]
);
broken!(
    an_index_below_zero,
    "<shape type=\"sphere\"><bsdf type=\"dielectric\"><float name=\"int_ior\" value=\"-1\"/></bsdf></shape>",
    ["2:22: the indices of bsdf \"dielectric\" must be above 0"]
);
broken!(
    a_blend_of_one,
    "<shape type=\"sphere\"><bsdf type=\"blendbsdf\"><bsdf type=\"diffuse\"/></bsdf></shape>",
    ["2:22: bsdf \"blendbsdf\" needs two bsdfs in it"]
);
broken!(
    a_bump_map_without_a_map,
    "<shape type=\"sphere\"><bsdf type=\"bumpmap\"><bsdf type=\"diffuse\"/></bsdf></shape>",
    ["2:22: bsdf \"bumpmap\" has no texture in it"]
);
broken!(
    a_normal_map_without_a_map,
    "<shape type=\"sphere\"><bsdf type=\"normalmap\"><bsdf type=\"diffuse\"/></bsdf></shape>",
    ["2:22: bsdf \"normalmap\" has no texture normalmap"]
);
broken!(
    wavelengths_and_values_of_two_numbers,
    "<emitter type=\"constant\"><texture type=\"irregular\" name=\"radiance\"><string name=\"wavelengths\" value=\"400 500\"/><string name=\"values\" value=\"1\"/></texture></emitter>",
    ["2:26: 2 wavelengths and 1 values"]
);
broken!(
    an_integrator_around_nothing,
    "<integrator type=\"moment\"/>",
    ["2:1: integrator \"moment\" has no integrator in it; add <integrator type=\"path\"/> to it"]
);
broken!(
    a_picture_that_is_not_there,
    "<emitter type=\"envmap\"><string name=\"filename\" value=\"nowhere.exr\"/></emitter>",
    ["2:24: there is no file \"nowhere.exr\" in the scene's folder, nor where <path> points"]
);
broken!(
    an_include_that_is_not_there,
    "<include filename=\"nowhere.xml\"/>",
    ["2:1: there is no file \"nowhere.xml\" in the scene's folder, nor where <path> points"]
);
broken!(
    several_errors_are_told_at_once,
    "<shape type=\"sphere\"><float name=\"radius\" value=\"a\"/></shape>\n<shap/>\n<emitter/>",
    [
        "2:22: radius must be a number, not \"a\"",
        "3:1: unknown element <shap>; did you mean \"shape\"?",
        "4:1: <emitter> has no type",
    ]
);

/// A scene with one sensor.
fn sensor(sensor: &str) -> String {
    format!("<scene version=\"3.0.0\">\n{sensor}\n</scene>")
}

broken_text!(
    a_field_of_view_of_a_half_turn,
    &sensor("<sensor type=\"perspective\"><float name=\"fov\" value=\"180\"/></sensor>"),
    ["2:1: fov must be above 0 and below 180, not 180"]
);
broken_text!(
    a_focal_length_in_inches,
    &sensor("<sensor type=\"perspective\"><string name=\"focal_length\" value=\"2in\"/></sensor>"),
    ["2:28: focal_length must be a length like 50mm, not \"2in\""]
);
broken_text!(
    an_unknown_axis,
    &sensor(
        "<sensor type=\"perspective\"><float name=\"fov\" value=\"9\"/><string name=\"fov_axis\" value=\"z\"/></sensor>"
    ),
    ["2:57: fov_axis of sensor \"perspective\" must be x or y or diagonal or smaller or larger, not \"z\""]
);
broken_text!(
    a_film_without_pixels,
    &sensor(
        "<sensor type=\"perspective\"><film type=\"hdrfilm\"><integer name=\"width\" value=\"0\"/></film></sensor>"
    ),
    ["2:28: width must be from 1 to 65536, not 0"]
);
broken_text!(
    a_crop_beyond_the_film,
    &sensor(
        "<sensor type=\"perspective\"><film type=\"hdrfilm\"><integer name=\"crop_offset_x\" value=\"9\"/></film></sensor>"
    ),
    ["2:28: the crop of the film reaches beyond its 768×576 pixels"]
);
broken_text!(
    a_lens_without_a_radius,
    &sensor("<sensor type=\"thinlens\"/>"),
    ["2:1: sensor \"thinlens\" has no aperture_radius"]
);
broken_text!(
    a_sensor_that_is_no_camera,
    &sensor("<sensor type=\"radiancemeter\"/>"),
    ["2:1: sensor \"radiancemeter\" has no counterpart; use perspective, thinlens or orthographic"]
);
